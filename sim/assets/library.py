"""The table of classes and how their looks are drawn."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset
from sim.assets.barrel import make_barrel
from sim.assets.building import make_building, make_wall
from sim.assets.car import make_car
from sim.assets.cone import make_cone
from sim.assets.hydrant import make_hydrant
from sim.assets.props import (
    make_ball,
    make_bench,
    make_bin,
    make_bush,
    make_crate,
    make_post,
    make_rock,
    make_sign,
)  # fmt: skip
from sim.assets.tree import make_tree

DETECTED = ("cone", "hydrant", "barrel", "tree", "car", "building")
"""Classes of the detector, in the order of its class ids."""

MAKERS: dict[str, Callable[[Generator], Asset]] = {
    "cone": make_cone,
    "hydrant": make_hydrant,
    "barrel": make_barrel,
    "tree": make_tree,
    "car": make_car,
    "building": make_building,
    "wall": make_wall,
    "bench": make_bench,
    "post": make_post,
    "crate": make_crate,
    "rock": make_rock,
    "bin": make_bin,
    "sign": make_sign,
    "bush": make_bush,
    "ball": make_ball,
}
DISTRACTORS = ("bench", "post", "crate", "rock", "bin", "sign", "bush", "ball")


class UnknownClassError(ValueError):
    """There is no maker for the class that was asked for."""


@lru_cache(maxsize=128)
def make_asset(label: str, look: int) -> Asset:
    """The object of class `label` whose colours, proportions and textures are drawn from `look`.

    Same label and look, same arrays. Raises `UnknownClassError` naming the classes there are.
    """
    if label not in MAKERS:
        raise UnknownClassError(f"no class {label!r}; there are: {', '.join(MAKERS)}")
    return MAKERS[label](np.random.default_rng([look, *label.encode()]))
