"""Furnished rooms beside one another: what the classifier of places learns from.

A suite is one room of the kind asked for and one or two neighbours of any kind, with open doorways
between them. It is data; `sim.rendering.rooms` draws it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator

from schemas.geometry import Pose2
from sim.scenes.floor_plan import WALL, Rectangle

ROOM_KINDS = (
    "kitchen",
    "office",
    "hallway",
    "lab",
    "lounge",
    "elevator",
    "conference room",
    "cafeteria",
)
"""Types of places, as the robots' languages name them."""

SIZES: dict[str, tuple[tuple[float, float], tuple[float, float]]] = {
    "kitchen": ((2.6, 5.0), (2.6, 4.5)),
    "office": ((3.0, 6.0), (2.8, 5.0)),
    "hallway": ((6.0, 14.0), (1.8, 2.8)),
    "lab": ((4.5, 9.0), (4.5, 8.0)),
    "lounge": ((4.0, 8.0), (3.8, 7.0)),
    "elevator": ((2.6, 5.0), (2.2, 3.5)),
    "conference room": ((4.6, 8.5), (3.6, 5.5)),
    "cafeteria": ((6.0, 12.0), (5.5, 10.0)),
}
"""Least and greatest longer and shorter sides [m]."""
CABIN = 2.04
"""Side of a lift's cabin [m]."""
DOOR_HEIGHT = 2.1

_cabin_share = 0.25


@dataclass(frozen=True)
class Room:
    """One room, its floor a rectangle."""

    kind: str
    floor: Rectangle
    height: float
    """[m]"""
    look: int
    """Seed of paint, floor, ceiling and light."""

    @property
    def is_cabin(self) -> bool:
        """Whether this is the inside of a lift."""
        return self.kind == "elevator" and self.width == CABIN == self.depth

    @property
    def width(self) -> float:
        """Along x [m]."""
        return round(self.floor[2] - self.floor[0], 6)

    @property
    def depth(self) -> float:
        """Along y [m]."""
        return round(self.floor[3] - self.floor[1], 6)

    def holds(self, x: float, y: float, margin: float = 0.0) -> bool:
        """Whether a point is on the floor, at least a margin from its walls [m]."""
        x0, y0, x1, y1 = self.floor
        return x0 + margin < x < x1 - margin and y0 + margin < y < y1 - margin


@dataclass(frozen=True)
class Piece:
    """One piece of furniture, `sim.assets.furniture_library.make_furniture(label, look)`."""

    label: str
    look: int
    pose: Pose2


@dataclass(frozen=True)
class Suite:
    """Rooms, the first being the one that was asked for, and what stands in them."""

    rooms: tuple[Room, ...]
    doors: tuple[Rectangle, ...]
    """Open doorways, each through one wall."""
    pieces: tuple[Piece, ...] = ()
    blocked: tuple[Rectangle, ...] = field(default=(), repr=False)
    """Floor under the furniture."""

    def kind_at(self, x: float, y: float) -> str | None:
        """Type of the room that a point lies in; None in doorways and walls."""
        return next((room.kind for room in self.rooms if room.holds(x, y)), None)


def empty_suite(rng: Generator, kind: str) -> Suite:
    """Rooms without furniture."""
    main = Room(kind, (0.0, 0.0, *_size(rng, kind)), _height(rng, kind), _look(rng))
    rooms, doors = [main], list[Rectangle]()
    wanted = 1 if main.is_cabin else int(rng.integers(1, 3))
    for side in rng.permutation(4).tolist():
        beside = _neighbour(rng, main, side)
        if beside and not any(_touch(beside[0].floor, other.floor) for other in rooms[1:]):
            rooms.append(beside[0])
            doors.append(beside[1])
        if len(doors) == wanted:
            break
    return Suite(tuple(rooms), tuple(doors))


def turned(side: int, a: float, b: float) -> tuple[float, float]:
    """Coordinates along and across a wall (sides 0, 2 run along x; 1, 3 along y) as x, y."""
    return (a, b) if side % 2 == 0 else (b, a)


def _size(rng: Generator, kind: str) -> tuple[float, float]:
    if kind == "elevator" and rng.random() < _cabin_share:
        return CABIN, CABIN
    long, short = (rng.uniform(*limits) for limits in SIZES[kind])
    return (long, short) if rng.random() < 0.5 else (short, long)


def _height(rng: Generator, kind: str) -> float:
    return rng.uniform(2.4, 3.6 if kind in ("lab", "cafeteria") else 3.0)


def _look(rng: Generator) -> int:
    return int(rng.integers(2**31))


def _neighbour(rng: Generator, main: Room, side: int) -> tuple[Room, Rectangle] | None:
    """A room behind one wall of another, and the doorway; None where no door fits."""
    kind = str(rng.choice(ROOM_KINDS)) if rng.random() < 0.7 else "hallway"
    size, door = _size(rng, kind), rng.uniform(0.9, 1.6)
    low, high = turned(side, *main.floor[:2])[0], turned(side, *main.floor[2:])[0]
    long = turned(side, *size)[0]
    margin = 0.15
    # The doorway comes first; the neighbour is then laid so that it has it too.
    if min(high - low, long) < door + 2 * margin:
        return None
    begin = rng.uniform(low + margin, high - margin - door)
    start = rng.uniform(begin + door + margin - long, begin - margin)
    near, far = _across(main, side, turned(side, *size)[1])
    wall = sorted((near, near + math.copysign(WALL, far - near)))
    floor = _rectangle(side, (start, start + long), sorted((wall[far > near], far)))
    room = Room(kind, floor, _height(rng, kind), _look(rng))
    return room, _rectangle(side, (begin, begin + door), wall)


def _across(main: Room, side: int, depth: float) -> tuple[float, float]:
    """Where a wall stands across its direction, and where a neighbour behind it ends."""
    outward = -1 if side in (0, 3) else 1
    near = turned(side, *(main.floor[:2] if outward < 0 else main.floor[2:]))[1]
    return near, near + outward * (WALL + depth)


def _rectangle(side: int, along: tuple[float, float], across: list[float]) -> Rectangle:
    x0, y0 = turned(side, along[0], across[0])
    x1, y1 = turned(side, along[1], across[1])
    return x0, y0, x1, y1


def _touch(one: Rectangle, other: Rectangle) -> bool:
    return overlap(one, other, WALL)


def overlap(one: Rectangle, other: Rectangle, gap: float = 0.0) -> bool:
    """Whether two rectangles come nearer to one another than a gap [m]."""
    apart = np.array([one[0] - other[2], other[0] - one[2], one[1] - other[3], other[1] - one[3]])
    return bool((apart < gap).all())
