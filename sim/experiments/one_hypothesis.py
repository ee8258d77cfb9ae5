"""The robot that believes its best guess: of all hypotheses only the likeliest is published."""

from collections.abc import Iterable
from functools import partial
from typing import Any

import msgspec
import numpy as np

from schemas import topics
from schemas.arrays import Floats, Ints
from schemas.belief import MapBelief, first_topology
from schemas.run import RunConfig
from schemas.topics import Handler, Handlers, Output
from services.mapping.node import MappingNode
from services.runtime.node import node_generator

_alike_within = 1.0
"""Width of the kernel by which hypotheses about the same things support one another [m]."""


class OneHypothesis:
    """Mapping whose beliefs hold a single hypothesis, its full filter behind it."""

    def __init__(self, run: RunConfig) -> None:
        self._mapping = MappingNode(run, node_generator(run, "mapping")).handlers()

    def handlers(self) -> Handlers:
        """As mapping."""
        return {topic: partial(_reduced, handler) for topic, handler in self._mapping.items()}


def _reduced(handler: Handler, message: Any) -> Iterable[Output]:
    for output in handler(message):
        if isinstance(output.message, MapBelief):
            yield topics.BELIEF.of(likeliest(output.message))
        else:
            yield output


def likeliest(belief: MapBelief) -> MapBelief:
    """The belief that is sure of the hypothesis around which most weight lies.

    Weights alone cannot tell: after resampling all of them are equal.
    """
    best = int(np.argmax(_weight_around(belief)))
    topology = int(belief.topology[best])
    rows = belief.rows_of(best)
    renamed = {best: 0, first_topology - topology: first_topology}
    particle = [renamed.get(owner, owner) for owner in belief.particle[rows].tolist()]
    columns = ("node", "class_index", "class_probability", "position", "covariance", "extent")
    edges = belief.region_edges[belief.region_edges[:, 0] == topology]
    return msgspec.structs.replace(
        belief,
        weights=np.ones(1),
        particle=np.array(particle, np.int32),
        **{name: getattr(belief, name)[rows] for name in (*columns, "existence")},
        figure=belief.figure[[best]],
        landmark=belief.landmark[[best]],
        figure_class=belief.figure_class[[best]],
        landmark_class=belief.landmark_class[[best]],
        topology=np.zeros(1, np.int32),
        node_regions=belief.node_regions[topology : topology + 1],
        region_edges=edges * np.array([0, 1, 1], np.int32),
        effective_particles=1.0,
    )


def _weight_around(belief: MapBelief) -> Floats:
    """Density (P,) of the belief at each hypothesis, up to a factor."""
    alike = np.ones((len(belief.weights),) * 2)
    for nodes in (belief.figure, belief.landmark):
        places = _places(belief, nodes)
        gaps = np.linalg.norm(places[:, None] - places, axis=2)
        alike *= (nodes[:, None] == nodes) * np.exp(-0.5 * (gaps / _alike_within) ** 2)
    return alike @ belief.weights


def _places(belief: MapBelief, nodes: Ints) -> Floats:
    """Where each hypothesis has its node (P,), shape (P, 2); the origin where it has none."""
    row = belief.row_of(np.arange(len(nodes), dtype=np.int32), nodes)
    places = np.zeros((len(nodes), 2))
    places[row >= 0] = belief.position[row[row >= 0]]
    return places
