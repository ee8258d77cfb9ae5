"""Floors of an office building, after the paper's multi-room experiment (Sec. Simulations).

A lab has two doors, to either side of where the robot starts, with ways to them that are equally
long; behind each there is a hallway, and a kitchen is down one of the two. The plan is made so
that the way to the kitchen is as long as the paper's with a known map, 12.88 m, and the first look
goes towards the right hallway, give or take 20 degrees. A seed turns the plan by quarters, mirrors
it or not, and draws the heading.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from schemas.geometry import Pose2, wrap_angle
from sim.scenes.floor_plan import Rectangle, walls_around
from sim.scenes.model import Ground, Region, Sun, Wall, World

GOAL = "kitchen_1"
"""Id of the place that the instruction means."""

Point = tuple[float, float]

_stream = 21
_start: Point = (5.3, 5.3)
_heading_spread = math.radians(20)


@dataclass(frozen=True)
class Plan:
    """Rooms by type and the doors between them, before turning and mirroring [m]."""

    rooms: tuple[tuple[str, Rectangle], ...]
    doors: tuple[Rectangle, ...]


_lab = ("lab", (3.0, 3.0, 11.0, 11.0))
_right_hall = (
    ("hallway", (11.2, 5.8, 27.0, 8.2)),
    ("kitchen", (13.4, 8.4, 18.4, 12.0)),
    ("office", (19.4, 1.6, 24.0, 5.6)),
    ("office", (22.4, 8.4, 27.0, 12.4)),
)
_right_doors = (
    (11.0, 6.2, 11.2, 7.8),
    (15.0, 8.2, 16.4, 8.4),
    (21.0, 5.6, 22.2, 5.8),
    (24.0, 8.2, 25.2, 8.4),
)
_wrong_door = (6.2, 11.0, 7.8, 11.2)

OFFICE = Plan(
    rooms=(
        _lab,
        *_right_hall,
        ("hallway", (5.8, 11.2, 8.2, 21.4)),
        ("office", (8.4, 15.0, 12.6, 18.6)),
    ),
    doors=(*_right_doors, _wrong_door, (8.2, 16.0, 8.4, 17.2)),
)
"""The wrong hallway is short and leads to one office."""

OFFICE_LONG = Plan(
    rooms=(
        _lab,
        *_right_hall,
        ("hallway", (5.8, 11.2, 8.2, 27.0)),
        ("office", (8.4, 14.0, 12.6, 17.6)),
        ("office", (1.4, 16.4, 5.6, 20.0)),
        ("conference room", (8.4, 18.4, 13.4, 23.4)),
        ("office", (1.4, 22.4, 5.6, 26.0)),
    ),
    doors=(
        *_right_doors,
        _wrong_door,
        (8.2, 15.0, 8.4, 16.2),
        (5.6, 17.4, 5.8, 18.6),
        (8.2, 20.4, 8.4, 21.6),
        (5.6, 23.6, 5.8, 24.8),
    ),
)
"""The wrong hallway is as long as the right one, and has four rooms to look into."""


@dataclass(frozen=True)
class _Symmetry:
    """One of the eight ways to lay a square plan on itself, about the start."""

    quarters: int
    mirrored: bool

    def point(self, point: Point) -> Point:
        x, y = point[0] - _start[0], point[1] - _start[1]
        y = -y if self.mirrored else y
        c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[self.quarters]
        return round(c * x - s * y, 6), round(s * x + c * y, 6)

    def angle(self, angle: float) -> float:
        return wrap_angle((-angle if self.mirrored else angle) + self.quarters * math.pi / 2)


def make_office(seed: int) -> World:
    """A kitchen down one of two hallways; the other is short and has one office."""
    return _world("office", OFFICE, seed, _heading_spread)


def make_office_long(seed: int) -> World:
    """A kitchen down one of two hallways; the other is as long and has four rooms."""
    return _world("office_long", OFFICE_LONG, seed, _heading_spread)


def make_office_turned(seed: int) -> World:
    """As office, but the robot may look anywhere at first."""
    return _world("office_turned", OFFICE, seed, math.pi)


def _world(name: str, plan: Plan, seed: int, heading_spread: float) -> World:
    rng = np.random.default_rng([seed, _stream])
    symmetry = _Symmetry(int(rng.integers(4)), bool(rng.integers(2)))
    heading = symmetry.angle(rng.uniform(-heading_spread, heading_spread))
    floor = (*(rectangle for _, rectangle in plan.rooms), *plan.doors)
    return World(
        name=name,
        seed=seed,
        ground=Ground(kind="concrete", look=0),
        sun=Sun(azimuth=0.0, elevation=1.2),
        world_from_start=Pose2(0.0, 0.0, heading),
        objects=(),
        walls=tuple(_laid(wall, symmetry) for wall in walls_around(floor)),
        regions=_regions(plan, symmetry),
    )


def _laid(wall: Wall, symmetry: _Symmetry) -> Wall:
    return Wall(
        start=symmetry.point(wall.start),
        end=symmetry.point(wall.end),
        thickness=wall.thickness,
        height=wall.height,
    )


def _regions(plan: Plan, symmetry: _Symmetry) -> tuple[Region, ...]:
    numbers: dict[str, int] = {}
    regions: list[Region] = []
    for kind, (x0, y0, x1, y1) in plan.rooms:
        numbers[kind] = numbers.get(kind, 0) + 1
        corners = [symmetry.point(corner) for corner in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
        if symmetry.mirrored:
            corners.reverse()
        name = f"{kind.replace(' ', '_')}_{numbers[kind]}"
        regions.append(Region(id=name, kind=kind, corners=tuple(corners)))
    return tuple(regions)
