"""What belongs into each kind of room, by chance; and things that may stand anywhere."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from numpy.random import Generator

from schemas.geometry import Pose2
from sim.scenes.floor_plan import Rectangle
from sim.scenes.rooms import Piece, Suite, empty_suite
from sim.scenes.rooms_placing import SIDES, RoomPlacing

ANYWHERE = (
    "plant",
    "waste bin",
    "painting",
    "notice board",
    "cabinet",
    "water cooler",
    "whiteboard",
)
"""These tell nothing about the kind of room."""
_hung = ("painting", "notice board", "whiteboard")


def furnished_suite(rng: Generator, kind: str) -> Suite:
    """Rooms with furniture; the first is of the kind asked for."""
    suite = empty_suite(rng, kind)
    pieces, blocked = list[Piece](), list[Rectangle]()
    for room in suite.rooms:
        placing = RoomPlacing(rng, room, suite.doors)
        FURNISH["cabin" if room.is_cabin else room.kind](placing)
        if not room.is_cabin:
            _anywhere(placing)
        pieces += placing.pieces
        blocked += placing.blocked
    return replace(suite, pieces=tuple(pieces), blocked=tuple(blocked))


def _kitchen(room: RoomPlacing) -> None:
    for _ in range(int(room.rng.integers(1, 4))):
        room.by_wall("counter")
    if room.chance(0.9):
        room.by_wall("fridge")
    if room.chance(0.5):
        room.in_middle("kitchen table", 0.3)


def _office(room: RoomPlacing) -> None:
    for _ in range(int(room.rng.integers(1, 4))):
        desk = room.by_wall("desk") if room.chance(0.8) else room.in_middle("desk")
        if desk and room.chance(0.9):
            room.before(desk, "office chair", 0.35)
    for label, chance in (
        ("bookshelf", 0.7),
        ("bookshelf", 0.4),
        ("cabinet", 0.6),
        ("cabinet", 0.3),
    ):
        if room.chance(chance):
            room.by_wall(label)


def _lab(room: RoomPlacing) -> None:
    for label, chance in (("fume hood", 0.55), ("rack", 0.4), ("gas bottle", 0.5), ("desk", 0.25)):
        if room.chance(chance):
            room.by_wall(label)
    for index in range(int(room.rng.integers(2, 6))):
        middle = index > 0 and room.chance(0.6)
        bench = room.in_middle("lab bench", 0.8) if middle else room.by_wall("lab bench")
        if bench and room.chance(0.7):
            room.before(bench, "stool", 0.25)


def _lounge(room: RoomPlacing) -> None:
    table = room.in_middle("low table", 0.9)
    for label, chance in (("sofa", 0.95), ("armchair", 0.6), ("sofa", 0.5)):
        if table and room.chance(chance):
            _around(room, table, label)
    for label, chance in (("sofa", 0.6), ("television", 0.55), ("lamp", 0.7), ("armchair", 0.5)):
        if room.chance(chance):
            room.by_wall(label)
    if room.chance(0.7):
        room.on_wall("painting")
    if room.chance(0.2):
        room.by_wall("bookshelf")


def _around(room: RoomPlacing, table: Piece, label: str) -> None:
    """Seats on some side of a table, turned towards it."""
    for _ in range(4):
        turn = float(room.rng.integers(4)) * math.pi / 2
        seat = table.pose @ Pose2(0, 0, turn) @ Pose2(room.rng.uniform(1.1, 1.5), 0, math.pi)
        if room.stand(label, seat):
            return


def _conference(room: RoomPlacing) -> None:
    room.in_middle("conference table", 0.3)
    if room.chance(0.85):
        room.on_wall("wall screen")
    if room.chance(0.5):
        room.on_wall("whiteboard")


def _cafeteria(room: RoomPlacing) -> None:
    for label, chance in (("serving counter", 0.7), ("vending machine", 0.6), ("counter", 0.15)):
        if room.chance(chance):
            room.by_wall(label)
    if room.chance(0.5):
        room.on_wall("menu board")
    x0, y0, x1, y1 = room.room.floor
    step, turn = room.rng.uniform(1.9, 2.5), float(room.rng.integers(2)) * math.pi / 4
    for x in _spaced(x0 + 1.2, x1 - 1.0, step):
        for y in _spaced(y0 + 1.2, y1 - 1.0, step):
            if room.chance(0.85):
                room.stand("cafeteria table", Pose2(x, y, turn + room.rng.normal(0, 0.1)))


def _spaced(low: float, high: float, step: float) -> list[float]:
    return [low + step * index for index in range(max(0, int((high - low) / step) + 1))]


def _hallway(room: RoomPlacing) -> None:
    x0, y0, x1, y1 = room.room.floor
    long = (0, 2) if x1 - x0 > y1 - y0 else (1, 3)
    for _ in range(int(room.rng.integers(2, 8))):
        room.on_wall("closed door", long if room.chance(0.9) else SIDES)
    for label, chance in (("notice board", 0.5), ("extinguisher", 0.6), ("painting", 0.3)):
        if room.chance(chance):
            room.on_wall(label, long)
    for label, chance in (("bench seat", 0.25), ("water cooler", 0.1), ("lift doors", 0.08)):
        if room.chance(chance):
            room.by_wall(label)
    if room.chance(0.5):
        middle, yaw = ((x0 + x1) / 2, (y0 + y1) / 2), 0.0 if long == (0, 2) else math.pi / 2
        room.hang("exit sign", Pose2(*middle, yaw + math.pi * room.rng.integers(2)))


def _lobby(room: RoomPlacing) -> None:
    side = int(room.rng.integers(4))
    for _ in range(int(room.rng.integers(1, 4))):
        if room.by_wall("lift doors", (side,)) is None:
            room.by_wall("lift doors")
    for label, chance in (("ash stand", 0.4), ("bench seat", 0.1)):
        if room.chance(chance):
            room.by_wall(label)


def _cabin(room: RoomPlacing) -> None:
    for side in SIDES:
        room.on_wall("cabin wall", (side,))


def _anywhere(room: RoomPlacing) -> None:
    for _ in range(int(room.rng.integers(0, 4))):
        label = str(room.rng.choice(ANYWHERE))
        (room.on_wall if label in _hung else room.by_wall)(label)


FURNISH: dict[str, Callable[[RoomPlacing], None]] = {
    "kitchen": _kitchen,
    "office": _office,
    "hallway": _hallway,
    "lab": _lab,
    "lounge": _lounge,
    "elevator": _lobby,
    "cabin": _cabin,
    "conference room": _conference,
    "cafeteria": _cafeteria,
}
