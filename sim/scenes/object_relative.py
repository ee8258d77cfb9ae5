"""Worlds of the paper's Monte Carlo runs with the Husky: nothing but hydrants and cones (Table 1).

What the robot of the paper drove with the full map known, mean and deviation, is given by the
table; goals stand that far away, and `STOP_SHORT` farther. That the things lie ahead of the robot
is inferred: an unbounded plane seen 3 m far would take more than twice the way that the paper's
runs without a relation took.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from schemas.geometry import Pose2
from sim.scenes.hydrant import GAP, SECTOR, hydrant_behind_cone
from sim.scenes.model import World
from sim.scenes.placement import Placement, in_ring, random_ground, random_sun

STOP_SHORT = 1.3
"""From the middle of the robot to that of the goal when it has arrived [m]."""
ARENA = 16.0
"""No object is farther from the start [m]."""
GOAL, LANDMARK = "hydrant_1", "cone_1"
"""Ids of what the instruction means."""

Point = tuple[float, float]

_clearance = 0.3
_first_stream = 11
_cones_apart = 4.5
_hydrants_apart = 3.5
_apart_for_sure = 2 * STOP_SHORT + 0.2
"""Standing at one thing is not standing at the other [m]."""
_near_cone = (1.5, 3.0)
_farther_from_cone = (1.2, 3.5)


@dataclass(frozen=True)
class Layout:
    """Where everything stands, the goal and its landmark first."""

    hydrants: tuple[Point, ...]
    cones: tuple[Point, ...]


def one_hydrant_one_cone(rng: Generator) -> Layout:
    """A hydrant behind a cone."""
    cone, goal = hydrant_behind_cone(rng, 8.75 + STOP_SHORT, 1.69)
    return Layout((goal,), (cone,))


def one_hydrant_two_cones(rng: Generator) -> Layout:
    """A hydrant behind one of two cones."""
    cone, goal = hydrant_behind_cone(rng, 11.18 + STOP_SHORT, 1.38)
    return Layout((goal,), (cone, _idle_cone(rng, cone, goal)))


def two_hydrants_one_cone(rng: Generator) -> Layout:
    """Two hydrants, one of them behind the cone.

    They are equally far on average: where nothing is said of the cone, which one is found is
    chance.
    """
    distance = (10.3 + STOP_SHORT, 1.83)
    cone, goal = hydrant_behind_cone(rng, *distance)
    while True:
        other = _ahead(float(rng.normal(*distance)), rng)
        apart = min(math.dist(other, goal), math.dist(other, cone)) > _hydrants_apart
        if apart and math.cos(_off_behind(other, cone)) < 0.5:
            return Layout((goal, other), (cone,))


def nearest_hydrant(rng: Generator) -> Layout:
    """Two hydrants round a cone, one of them nearer to it."""
    while True:
        goal = _ahead(float(rng.normal(9.19 + STOP_SHORT, 1.54)), rng)
        gap = rng.uniform(*_near_cone)
        cone = _beside(goal, gap, rng)
        other = _beside(cone, gap + rng.uniform(*_farther_from_cone), rng)
        if _is_ahead(cone) and _is_ahead(other) and math.dist(goal, other) > _apart_for_sure:
            return Layout((goal, other), (cone,))


LAYOUTS: tuple[Callable[[Generator], Layout], ...] = (
    one_hydrant_one_cone,
    one_hydrant_two_cones,
    two_hydrants_one_cone,
    nearest_hydrant,
)


def layout_of(name: str, seed: int) -> tuple[Layout, Generator]:
    """Where things stand in the world of that name, and the generator for what is left to draw."""
    names = [draw.__name__ for draw in LAYOUTS]
    number = names.index(name)
    rng = np.random.default_rng([seed, _first_stream + number])
    return LAYOUTS[number](rng), rng


def make_object_relative(name: str, seed: int) -> World:
    """The world of a layout, on some ground under some sun."""
    layout, rng = layout_of(name, seed)
    placement = Placement(rng, _clearance)
    for label, points in (("hydrant", layout.hydrants), ("cone", layout.cones)):
        for x, y in points:
            placement.put_at(label, x, y)
    return World(
        name=name, seed=seed, ground=random_ground(rng), sun=random_sun(rng),
        world_from_start=Pose2(0.0, 0.0, 0.0), objects=tuple(placement.objects),
    )  # fmt: skip


def _idle_cone(rng: Generator, cone: Point, goal: Point) -> Point:
    """A cone that no hydrant is behind."""
    draw = in_ring(rng, 4.0, 12.0)
    while True:
        x, y = draw()
        apart = math.dist((x, y), cone) > _cones_apart and math.dist((x, y), goal) > GAP[0]
        if _is_ahead((x, y)) and apart and math.cos(_off_behind(goal, (x, y))) < 0.5:
            return x, y


def _off_behind(figure: Point, landmark: Point) -> float:
    """Angle by which a figure is off "behind" a landmark, seen from the start [rad]."""
    direction = math.atan2(figure[1] - landmark[1], figure[0] - landmark[0])
    return direction - math.atan2(landmark[1], landmark[0])


def _ahead(distance: float, rng: Generator) -> Point:
    bearing = rng.uniform(-SECTOR, SECTOR)
    return distance * math.cos(bearing), distance * math.sin(bearing)


def _beside(point: Point, distance: float, rng: Generator) -> Point:
    angle = rng.uniform(-math.pi, math.pi)
    return point[0] + distance * math.cos(angle), point[1] + distance * math.sin(angle)


def _is_ahead(point: Point) -> bool:
    return abs(math.atan2(point[1], point[0])) <= SECTOR and 4.0 < math.hypot(*point) < ARENA
