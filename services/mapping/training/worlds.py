"""Where things stand in training worlds, in the frame of the robot when it is spoken to.

Seeds from 100000 on are for training; evaluation uses others.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from schemas.arrays import Floats
from services.mapping.prior import Role
from sim.scenes.object_relative import LAYOUTS, layout_of

FIRST_SEED = 100_000


@dataclass(frozen=True)
class TrainingWorld:
    """Hydrants and cones; the first of each are the ones that instructions speak of."""

    name: str
    hydrants: Floats
    """(H, 2) [m]"""
    cones: Floats
    """(C, 2) [m]"""


def sample_world(name: str, seed: int) -> TrainingWorld:
    """The world of a layout by name."""
    layout, _ = layout_of(name, seed)
    return TrainingWorld(name, np.array(layout.hydrants), np.array(layout.cones))


def sample_worlds(count: int, first_seed: int) -> list[TrainingWorld]:
    """`count` worlds of each layout."""
    names = [draw.__name__ for draw in LAYOUTS]
    return [
        sample_world(name, seed) for name in names for seed in range(first_seed, first_seed + count)
    ]


def places_meant(worlds: Sequence[TrainingWorld], role: Role) -> Floats:
    """Places (n, 2) of what instructions speak of in a role [m]."""
    places = [(w.hydrants if role == "figure" else w.cones)[0] for w in worlds]
    return np.array(places).reshape(-1, 2)
