"""Worlds of the paper's first experiment: a hydrant behind a cone, nothing in sight at the start.

Distances follow the known-map column of Table 1: from start to goal N(9.25, 1.69) m with one
hydrant, N(10.9, 1.85) m with two. The robot stands at the origin and looks along +x.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from schemas.geometry import Pose2
from sim.scenes.model import World
from sim.scenes.placement import Placement, in_ring, random_ground, random_sun

SECTOR = math.radians(50)
"""Objects of the instruction lie within this angle to either side of the robot's view."""
GAP = (2.0, 4.0)
"""From cone to hydrant [m]."""
OFF_RAY = math.radians(18)
"""Deviation of the hydrant's direction from the ray robot -> cone."""
START_CLEARANCE = 2.0
CLEARANCE = 0.7
"""Free space around every object [m]; two of them let a Husky through."""
CLUTTER = ("bench", "bin", "sign", "post")
"""Distractors tall enough for the laser to see."""

Point = tuple[float, float]


def hydrant_behind_cone(rng: Generator, mean: float, deviation: float) -> tuple[Point, Point]:
    """Positions of cone and hydrant [m]; the hydrant is about `mean` away, within the sector."""
    while True:
        distance = float(np.clip(rng.normal(mean, deviation), mean - 3.2, mean + 4.5))
        gap, off = rng.uniform(*GAP), rng.normal(0, OFF_RAY)
        bearing = rng.uniform(-SECTOR, SECTOR)
        to_cone = math.sqrt(distance**2 - (gap * math.sin(off)) ** 2) - gap * math.cos(off)
        cone = (to_cone * math.cos(bearing), to_cone * math.sin(bearing))
        hydrant = (
            cone[0] + gap * math.cos(bearing + off),
            cone[1] + gap * math.sin(bearing + off),
        )
        if to_cone > START_CLEARANCE + 1 and abs(math.atan2(hydrant[1], hydrant[0])) <= SECTOR:
            return cone, hydrant


def not_behind(rng: Generator, cone: Point, goal: Point) -> Point:
    """A second hydrant: over 3.5 m from the goal and over 60 degrees off "behind the cone"."""
    draw = in_ring(rng, 4.0, 12.0)
    while True:
        x, y = draw()
        off = math.atan2(y - cone[1], x - cone[0]) - math.atan2(cone[1], cone[0])
        apart = math.hypot(x - goal[0], y - goal[1]) > 3.5
        clear = math.hypot(x - cone[0], y - cone[1]) > GAP[0] + 0.2
        if abs(math.atan2(y, x)) <= SECTOR and apart and clear and math.cos(off) < 0.5:
            return x, y


def make_hydrant(seed: int) -> World:
    """One hydrant behind one cone, among barrels, trees, a car, a building and street furniture."""
    rng = np.random.default_rng([seed, 1])
    cone, goal = hydrant_behind_cone(rng, 9.25, 1.69)
    placement = _with(rng, [("cone", cone), ("hydrant", goal)])
    return _world("hydrant", seed, rng, placement)


def make_two_hydrants(seed: int) -> World:
    """As `hydrant`, with a second hydrant that is not behind the cone (its id is hydrant_2)."""
    rng = np.random.default_rng([seed, 2])
    cone, goal = hydrant_behind_cone(rng, 10.9, 1.85)
    other = not_behind(rng, cone, goal)
    placement = _with(rng, [("cone", cone), ("hydrant", goal), ("hydrant", other)])
    return _world("two_hydrants", seed, rng, placement)


def _with(rng: Generator, objects: list[tuple[str, Point]]) -> Placement:
    placement = Placement(rng, CLEARANCE)
    placement.reserve(0.0, 0.0, START_CLEARANCE)
    for label, (x, y) in objects:
        placement.put_at(label, x, y)
    return placement


def _world(name: str, seed: int, rng: Generator, placement: Placement) -> World:
    """The world with clutter around what the instruction is about."""
    rings = [("building", 16.0, 22.0), ("car", 6.0, 15.0), *[("barrel", 3.5, 13.0)] * 3]
    rings += [("tree", 4.0, 15.0)] * 4
    rings += [(str(rng.choice(CLUTTER)), 4.0, 14.0) for _ in range(3)]
    for label, low, high in rings:
        placement.put(label, in_ring(rng, low, high))
    return World(
        name=name, seed=seed, ground=random_ground(rng), sun=random_sun(rng),
        world_from_start=Pose2(0.0, 0.0, 0.0), objects=tuple(placement.objects),
    )  # fmt: skip
