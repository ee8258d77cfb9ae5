"""A filter put back where a belief left it, after the process was killed."""

import numpy as np

from schemas.arrays import Floats
from schemas.belief import MapBelief, shared
from services.mapping.allocation import Topologies
from services.mapping.backbone import Backbone, Uncertainty
from services.mapping.filter import SemanticFilter
from services.mapping.objects import TrackedObject
from services.mapping.particles import (
    Particles,
    first_glimpse,
    first_region,
    hypothesised_figure,
    hypothesised_landmark,
)
from services.mapping.places import Places
from services.mapping.topology import Edge, Region, Topology

_restored_hits = 10
_least = 1e-3


def restore(semantic: SemanticFilter, belief: MapBelief) -> None:
    """Put a fresh filter where `belief` left it.

    What an utterance means is not part of a belief: the next `recall` brings it back. Scans are
    not either, so that regions of the earlier life are divided no further.
    """
    odom_from_base = belief.map_from_odom.inverse() @ belief.map_from_base
    backbone = Backbone(belief.map_from_base, odom_from_base, np.array(belief.trajectory))
    for row in np.flatnonzero((belief.particle == shared) & (belief.node < first_glimpse)):
        thing = _thing(belief, int(row))
        semantic.objects.restore(thing)
        backbone.restore(thing.number, thing.mean, thing.covariance)
    semantic.viewer = belief.viewer
    if semantic.places is not None:
        _restore_places(semantic.places, belief)
        semantic.topologies = _topologies(belief)
    semantic.resume(backbone, _particles(belief), odom_from_base)


def _restore_places(places: Places, belief: MapBelief) -> None:
    places.restore(np.array(belief.trajectory))
    for row in np.flatnonzero(belief.node >= first_region):
        likely = _distribution(belief, int(row))[-len(places.locations) :]
        types = likely / likely.sum()
        if belief.node[row] >= first_glimpse:
            number = int(belief.node[row]) - first_glimpse
            places.restore_glimpse(number, np.array(belief.position[row]), np.log(types))
        else:
            places.restore_look(int(belief.node[row]) - first_region, np.log(types))


def _topologies(belief: MapBelief) -> Topologies:
    members = tuple(_topology(belief, index) for index in range(len(belief.node_regions)))
    shares = np.bincount(belief.topology, belief.weights, minlength=len(members))
    return Topologies(members, np.log(np.maximum(shares, _least)))


def _topology(belief: MapBelief, index: int) -> Topology:
    names = belief.node_regions[index]
    regions = [Region(tuple(np.flatnonzero(names == name).tolist())) for name in np.unique(names)]
    pairs = (belief.region_edges[belief.region_edges[:, 0] == index, 1:] - first_region).tolist()
    edges: list[Edge] = [(one, other) for one, other in pairs]
    return Topology(tuple(regions), frozenset(edges))


def _thing(belief: MapBelief, row: int) -> TrackedObject:
    existence = min(max(float(belief.existence[row]), _least), 1 - _least)
    return TrackedObject(
        number=int(belief.node[row]),
        mean=np.array(belief.position[row]),
        covariance=np.array(belief.covariance[row]),
        extent=np.array(belief.extent[row]),
        class_log=np.log(_distribution(belief, row)),
        odds=float(np.log(existence / (1 - existence))),
        hits=_restored_hits,
        seen_with=Uncertainty(0.0, 0.0),
    )


def _distribution(belief: MapBelief, row: int) -> Floats:
    """Over the classes (C,); of the others than the likeliest only the sum is known."""
    classes = len(belief.classes)
    likely = min(max(float(belief.class_probability[row]), _least), 1 - _least)
    share = np.full(classes, (1 - likely) / max(classes - 1, 1))
    share[belief.class_index[row]] = likely
    return share


def _particles(belief: MapBelief) -> Particles:
    return Particles(
        log_weight=np.log(np.maximum(belief.weights, 1e-300)),
        reading=np.zeros(len(belief.weights), np.int32),
        figure=np.array(belief.figure),
        landmark=np.array(belief.landmark),
        figure_position=_positions(belief, hypothesised_figure),
        landmark_position=_positions(belief, hypothesised_landmark),
        topology=np.array(belief.topology),
    )


def _positions(belief: MapBelief, node: int) -> Floats:
    viewer = np.array([belief.viewer.x, belief.viewer.y])
    places = np.tile(viewer, (len(belief.weights), 1))
    rows = (belief.node == node) & (belief.particle >= 0)
    places[belief.particle[rows]] = belief.position[rows]
    return places
