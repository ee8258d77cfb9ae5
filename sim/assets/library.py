"""The table of classes and how their looks are drawn."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.random import Generator

from schemas.arrays import Floats
from sim.assets.asset import Asset
from sim.assets.banana import make_banana
from sim.assets.barrel import make_barrel
from sim.assets.building import make_building
from sim.assets.car import make_car
from sim.assets.clutter import (
    make_backpack,
    make_book,
    make_bottle,
    make_bucket,
    make_can,
    make_carton,
    make_hammer,
    make_lemon,
    make_mug,
    make_plant,
    make_shoe,
)
from sim.assets.cone import make_cone
from sim.assets.drill import make_drill
from sim.assets.furniture import make_cabinet, make_chair, make_shelf, make_sofa, make_table
from sim.assets.groceries import make_cracker_box, make_mustard_bottle
from sim.assets.hydrant import make_hydrant
from sim.assets.open_box import make_box
from sim.assets.pitcher import make_pitcher
from sim.assets.props import (
    make_bench,
    make_bin,
    make_bush,
    make_crate,
    make_post,
    make_rock,
    make_sign,
)
from sim.assets.sphere import make_ball
from sim.assets.street import make_barrier, make_delineator, make_lamp, make_mailbox
from sim.assets.suitcase import make_suitcase
from sim.assets.tree import make_tree
from sim.assets.wall import make_wall

DETECTED = (
    "cone", "hydrant", "barrel", "tree", "car", "building", "wall", "drill", "suitcase", "banana",
    "pitcher", "cracker box", "mustard bottle", "ball", "box",
)  # fmt: skip
"""Classes of the detector, in the order of its class ids; names as in `robots.symbols`."""

MAKERS: dict[str, Callable[[Generator], Asset]] = {
    "cone": make_cone,
    "hydrant": make_hydrant,
    "barrel": make_barrel,
    "tree": make_tree,
    "car": make_car,
    "building": make_building,
    "wall": make_wall,
    "drill": make_drill,
    "suitcase": make_suitcase,
    "banana": make_banana,
    "pitcher": make_pitcher,
    "cracker box": make_cracker_box,
    "mustard bottle": make_mustard_bottle,
    "ball": make_ball,
    "box": make_box,
    "bench": make_bench,
    "post": make_post,
    "crate": make_crate,
    "rock": make_rock,
    "bin": make_bin,
    "sign": make_sign,
    "bush": make_bush,
    "mailbox": make_mailbox,
    "delineator": make_delineator,
    "barrier": make_barrier,
    "lamp": make_lamp,
    "carton": make_carton,
    "mug": make_mug,
    "bucket": make_bucket,
    "book": make_book,
    "can": make_can,
    "bottle": make_bottle,
    "shoe": make_shoe,
    "hammer": make_hammer,
    "backpack": make_backpack,
    "lemon": make_lemon,
    "plant": make_plant,
    "table": make_table,
    "chair": make_chair,
    "shelf": make_shelf,
    "cabinet": make_cabinet,
    "sofa": make_sofa,
}
SMALL = ("drill", "banana", "pitcher", "cracker box", "mustard bottle", "ball")
"""Detected classes that a hand can carry and a table or a box can hold."""
DISTRACTORS = (
    "bench", "post", "crate", "rock", "bin", "sign", "bush", "mailbox", "delineator", "barrier",
    "lamp",
)  # fmt: skip
"""Things of the street that are none of the classes."""
SMALL_DISTRACTORS = (
    "carton", "mug", "bucket", "book", "can", "bottle", "shoe", "hammer", "backpack", "lemon",
    "plant",
)  # fmt: skip
"""Small things that are none of the classes."""
FURNITURE = ("table", "chair", "shelf", "cabinet", "sofa")


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


def bounds(label: str, look: int) -> tuple[Floats, Floats]:
    """Lowest and highest corner of what can be touched of an object, each (3,) [m]."""
    shapes = make_asset(label, look).collisions
    low = np.min([np.subtract(s.center, s.half) for s in shapes], axis=0)
    return low, np.max([np.add(s.center, s.half) for s in shapes], axis=0)
