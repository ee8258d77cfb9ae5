"""A training scene as data: things at rest on a floor under a light."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from schemas.geometry import Pose2, Pose3, Quaternion, quaternion_product
from sim.assets.asset import Asset
from sim.rendering.ground import Covering
from sim.scenes.model import Ground, Sun


@dataclass(frozen=True)
class Support:
    """The level surface that something lies on."""

    height: float = 0.0
    """[m]"""
    covering: Covering | None = None
    """What its shadow falls on, the floor if none."""
    shaded: bool = True
    """Whether a shadow shows there at all."""


FLOOR = Support()


@dataclass(frozen=True, eq=False)
class Item:
    """One thing of a training scene."""

    asset: Asset
    world_from_object: Pose3
    support: Support = FLOOR

    @property
    def label(self) -> str:
        """Class name."""
        return self.asset.label

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Corners (8, 3) of the oriented bounding box in the world [m]."""
        low, high = self.asset.bounds
        grid = np.array([(a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1)])
        return self.world_from_object.apply(low + grid * (high - low))

    @cached_property
    def center(self) -> NDArray[np.float64]:
        """Middle (3,) of the bounding box in the world [m]."""
        return self.corners.mean(axis=0)

    @cached_property
    def radius(self) -> float:
        """Of the upright cylinder around the bounding box [m]."""
        return float(np.hypot(*(self.corners - self.center)[:, :2].T).max())

    @property
    def top(self) -> float:
        """Height of the highest corner [m]."""
        return float(self.corners[:, 2].max())

    @property
    def longest(self) -> float:
        """Longest side of the bounding box [m]."""
        return max(self.asset.size)


def rested(
    asset: Asset,
    x: float,
    y: float,
    yaw: float,
    support: Support = FLOOR,
    tilt: tuple[float, float] = (0.0, 0.0),
) -> Item:
    """The asset turned by roll and pitch [rad] and laid down with its middle over (x, y) [m]."""
    turn = _about((0, 0, 1), yaw)
    turn = quaternion_product(turn, _about((0, 1, 0), tilt[1]))
    turn = quaternion_product(turn, _about((1, 0, 0), tilt[0]))
    loose = Item(asset, Pose3((0.0, 0.0, 0.0), turn), support)
    if tilt == (0.0, 0.0):
        # Standing things keep their own origin: the middle of a tree's foot, not of its crown.
        offset = np.array([0.0, 0.0, 0.0])
    else:
        offset = np.array([*loose.center[:2], loose.corners[:, 2].min()])
    px, py, pz = (np.array([x, y, support.height]) - offset).tolist()
    return Item(asset, Pose3((px, py, pz), turn), support)


def _about(axis: tuple[int, int, int], angle: float) -> Quaternion:
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    return c, s * axis[0], s * axis[1], s * axis[2]


@dataclass(frozen=True, eq=False)
class TrainingScene:
    """Things on a floor under a light."""

    floor: Ground | Covering
    sun: Sun
    sky: int
    """Seed of the sky."""
    items: tuple[Item, ...]
    room: tuple[float, float, float] | None = None
    """Length, width and height of the room around the origin [m], none outdoors."""


Span = tuple[float, float]


class FreeSpace:
    """Discs that are taken, on the floor or on a table, while a scene is being furnished."""

    def __init__(self, rng: Generator) -> None:
        self._rng = rng
        self._discs: list[tuple[float, float, float]] = []

    def find(self, xs: Span, ys: Span, radius: float, tries: int = 40) -> Pose2 | None:
        """A place in a rectangle for a disc that touches none taken, at any heading; it is taken.

        None if no free place is found.
        """
        for _ in range(tries):
            x, y = self._rng.uniform(*xs), self._rng.uniform(*ys)
            if self.is_free(x, y, radius):
                self.take(x, y, radius)
                return Pose2(x, y, self._rng.uniform(-math.pi, math.pi))
        return None

    def is_free(self, x: float, y: float, radius: float) -> bool:
        """Whether a disc [m] touches none that is taken."""
        return all(math.hypot(x - a, y - b) > radius + r for a, b, r in self._discs)

    def take(self, x: float, y: float, radius: float) -> None:
        """Keep a disc [m] free of what comes later."""
        self._discs.append((x, y, radius))
