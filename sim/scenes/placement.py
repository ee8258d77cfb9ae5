"""Putting objects into free space, one after another."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import get_args

from numpy.random import Generator

from schemas.geometry import Pose2, wrap_angle
from sim.assets.library import make_asset
from sim.scenes.model import Ground, GroundKind, PlacedObject, Sun, WorldError

LOOKS = 2**31
TRIES = 200

Spot = Callable[[], tuple[float, float]]
"""Draws a position (x, y) [m]."""


class Placement:
    """Objects placed so far and circles that must stay free."""

    def __init__(self, rng: Generator, clearance: float = 0.3) -> None:
        self._rng = rng
        self._clearance = clearance
        self._discs: list[tuple[float, float, float]] = []
        self.objects: list[PlacedObject] = []

    def reserve(self, x: float, y: float, radius: float) -> None:
        """Keep a disc [m] free of everything placed later."""
        self._discs.append((x, y, radius))

    def is_free(self, x: float, y: float, radius: float) -> bool:
        """Whether a disc [m] touches nothing placed or reserved."""
        return all(math.hypot(x - a, y - b) > radius + r for a, b, r in self._discs)

    def put(self, label: str, spot: Spot, look: int | None = None) -> PlacedObject | None:
        """Place an object at the first free spot drawn, turned at random; None if none is free."""
        look = int(self._rng.integers(LOOKS)) if look is None else look
        radius = make_asset(label, look).footprint_radius + self._clearance
        for _ in range(TRIES):
            x, y = spot()
            if self.is_free(x, y, radius):
                return self._add(label, look, x, y, radius)
        return None

    def put_at(self, label: str, x: float, y: float) -> PlacedObject:
        """Place an object exactly there.

        Raises:
            WorldError: something is there already.
        """
        placed = self.put(label, lambda: (x, y))
        if placed is None:
            raise WorldError(f"no room for a {label} at ({x:.2f}, {y:.2f})")
        return placed

    def _add(self, label: str, look: int, x: float, y: float, radius: float) -> PlacedObject:
        number = 1 + sum(placed.label == label for placed in self.objects)
        yaw = wrap_angle(self._rng.uniform(-math.pi, math.pi))
        placed = PlacedObject(
            id=f"{label}_{number}", label=label, look=look, world_from_object=Pose2(x, y, yaw)
        )
        self.reserve(x, y, radius)
        self.objects.append(placed)
        return placed


def in_ring(
    rng: Generator, low: float, high: float, center: tuple[float, float] = (0.0, 0.0)
) -> Spot:
    """Positions spread evenly over a ring between two radii [m]."""

    def draw() -> tuple[float, float]:
        radius = math.sqrt(rng.uniform(low**2, high**2))
        angle = rng.uniform(-math.pi, math.pi)
        return center[0] + radius * math.cos(angle), center[1] + radius * math.sin(angle)

    return draw


def random_sun(rng: Generator) -> Sun:
    """Daylight from some direction, one time in five through clouds."""
    overcast = rng.random() < 0.2
    direct = rng.uniform(0.15, 0.4) if overcast else rng.uniform(0.8, 1.35)
    return Sun(
        azimuth=rng.uniform(-math.pi, math.pi),
        elevation=rng.uniform(0.35, 1.3),
        color=(direct, direct * rng.uniform(0.9, 1.0), direct * rng.uniform(0.75, 1.0)),
        ambient=rng.uniform(0.6, 0.85) if overcast else rng.uniform(0.3, 0.55),
    )


def random_ground(rng: Generator) -> Ground:
    """Some floor."""
    kinds: tuple[GroundKind, ...] = get_args(GroundKind)
    return Ground(kind=kinds[int(rng.integers(len(kinds)))], look=int(rng.integers(LOOKS)))
