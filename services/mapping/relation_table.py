"""The relations that words name: as learned (services/mapping/training), else by default.

Without data the mean is linear in the sizes of both things: a figure stands that far from the
landmark's edge, whatever the distance to the viewer.
"""

from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Literal

import msgspec
import numpy as np
from msgspec import Struct

from schemas.arrays import Floats
from services.mapping.relations import Axis, Directed, Radial, Relation, features

nearest = "nearest"
"""The comparative of "near": it leaves the distance open, candidates are compared instead."""
enclosed_in = "in a thing"
"""What "inside" means where the landmark is no place but a thing that others may lie in."""
_outliers = (0.01, 5.0)
"""Share, and spread [m], without data: people are imprecise."""


AxisName = Literal["u", "v", "distance"]


class AxisWeights(Struct, frozen=True, kw_only=True):
    """Of one coordinate, by the names in `relations.features`; what is left out is 0."""

    mean: Mapping[str, float]
    variance: Mapping[str, float]


class RelationWeights(Struct, frozen=True, kw_only=True):
    """What was learned of one relation, and how good it is."""

    axes: dict[AxisName, AxisWeights]
    """u and v, or the distance alone for what holds in every direction."""
    outlier_share: float
    outlier_spread: float
    count: int
    """Of examples that it was fitted to."""
    held_out: float
    """Mean log density of examples that it was not fitted to."""
    held_out_default: float
    """The same of the relation without data."""


class RelationFile(Struct, frozen=True, kw_only=True):
    """Weights of all relations, and where they come from."""

    source: str
    seed: int
    scenes: int
    relations: dict[str, RelationWeights]


class UnknownFeatureError(ValueError):
    """Weights name a feature that does not exist; the message lists those that do."""


def relation_named(name: str, comparative: bool) -> Relation:
    """Density of a relation symbol; those without a shape of their own are vague nearness."""
    known = relation_table()
    name = nearest if comparative and name == "near" else name
    return known.get(_synonyms.get(name, name), known["unknown"])


@cache
def relation_table() -> Mapping[str, Relation]:
    """All relations by name: learned ones, and defaults for the rest."""
    file = resources.files("services.mapping") / "weights" / "relations.json"
    weights = msgspec.json.decode(file.read_bytes(), type=RelationFile)
    return {**defaults, **{name: relation_of(one) for name, one in weights.relations.items()}}


def relation_of(weights: RelationWeights) -> Relation:
    """The relation with these weights."""
    axes = {name: axis_of(one.mean, one.variance) for name, one in weights.axes.items()}
    radial = "distance" in axes
    shape = Radial(axes["distance"]) if radial else Directed(axes["u"], axes["v"])
    return Relation(shape, weights.outlier_share, weights.outlier_spread)


def axis_of(mean: Mapping[str, float], variance: Mapping[str, float]) -> Axis:
    """Weights by name as vectors (D,).

    Raises:
        UnknownFeatureError: a name is not in `relations.features`.
    """
    unknown = sorted({*mean, *variance} - set(features))
    if unknown:
        raise UnknownFeatureError(
            f"unknown features {unknown}; features are: {', '.join(features)}"
        )
    return Axis(_vector(mean), _vector(variance))


def _vector(weights: Mapping[str, float]) -> Floats:
    return np.array([weights.get(name, 0.0) for name in features])


def _directed(u: float, v: float, gap: float, along: float, across: float) -> Relation:
    """To one side, beyond the edges of both things by a gap; deviations along it and across."""
    if u:
        deviations, mean_u, mean_v = (along, across), _beyond(u * gap, u, "depth"), {}
    else:
        deviations, mean_u, mean_v = (across, along), {}, _beyond(v * gap, v, "width")
    axes = [
        axis_of(mean, {"one": deviation**2})
        for mean, deviation in zip((mean_u, mean_v), deviations, strict=True)
    ]
    return Relation(Directed(*axes), *_outliers)


def _beyond(gap: float, side: float, size: str) -> dict[str, float]:
    return {"one": gap, "figure_radius": side, size: side}


def _inside() -> Relation:
    axes = [axis_of({}, {"one": 0.1**2, size: 0.5**2}) for size in ("depth", "width")]
    return Relation(Directed(*axes), *_outliers)


def _in_a_thing() -> Relation:
    """Between its walls, give or take what both places are wrong by."""
    axes = [axis_of({}, {"one": 0.05**2, size: 0.25**2}) for size in ("depth", "width")]
    return Relation(Directed(*axes), *_outliers)


def _on_the_way() -> Relation:
    axes = [
        axis_of({"distance": -0.3}, {"one": 0.5, "distance": 0.2**2}),
        axis_of({}, {"one": 0.5, "distance": 0.2**2}),
    ]
    return Relation(Directed(*axes), *_outliers)


def _radial(gap: float, spread: float) -> Relation:
    edges = {"one": gap, "figure_radius": 1.0, "depth": 0.5, "width": 0.5}
    return Relation(Radial(axis_of(edges, {"one": spread**2})), *_outliers)


defaults: Mapping[str, Relation] = {
    "back": _directed(1, 0, gap=2.4, along=1.1, across=0.9),
    "front": _directed(-1, 0, gap=2.0, along=1.1, across=0.9),
    "left": _directed(0, 1, gap=2.0, along=1.1, across=0.9),
    "right": _directed(0, -1, gap=2.0, along=1.1, across=0.9),
    "past": _directed(1, 0, gap=4.0, along=2.1, across=1.3),
    "down": _directed(1, 0, gap=4.0, along=2.1, across=1.3),
    "through": _directed(1, 0, gap=4.0, along=2.1, across=1.3),
    "towards": _on_the_way(),
    "inside": _inside(),
    enclosed_in: _in_a_thing(),
    "around": _radial(gap=2.0, spread=1.6),
    "near": _radial(gap=1.5, spread=0.9),
    "away": _radial(gap=6.0, spread=2.5),
    nearest: _radial(gap=2.0, spread=1.6),
    "unknown": _radial(gap=3.0, spread=2.5),
}
_synonyms = {"behind": "back"}
