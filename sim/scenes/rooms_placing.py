"""Putting furniture into one room: along its walls, on them, and in its middle."""

from __future__ import annotations

import math

from numpy.random import Generator

from schemas.geometry import Pose2
from sim.assets.asset import Asset
from sim.assets.furniture_library import make_furniture
from sim.scenes.floor_plan import Rectangle
from sim.scenes.rooms import Piece, Room, overlap, turned

SIDES = (0, 1, 2, 3)
"""Walls at the least y, greatest x, greatest y, least x."""
_yaw = (math.pi / 2, math.pi, -math.pi / 2, 0.0)
"""Of furniture that stands with its back to a wall."""
_tries = 14
_before_door = 0.9
"""Floor that stays free before a doorway [m]."""
_tall = 1.3
"""What stands on the floor and is higher leaves no room above it [m]."""


class RoomPlacing:
    """Furniture of one room so far.

    Args:
        rng: the only source of randomness.
        room: the room.
        doors: doorways, of this room and of others.
    """

    def __init__(self, rng: Generator, room: Room, doors: tuple[Rectangle, ...]) -> None:
        self.rng, self.room = rng, room
        self.pieces: list[Piece] = []
        self.blocked: list[Rectangle] = []
        self._hung: list[tuple[int, float, float]] = []
        self._kept_free: list[Rectangle] = []
        for door in doors:
            self._keep_free(door)

    def chance(self, probability: float) -> bool:
        """A coin."""
        return self.rng.random() < probability

    def by_wall(self, label: str, sides: tuple[int, ...] = SIDES) -> Piece | None:
        """Stand a piece against a wall where there is room; None if there is none."""
        look, asset = self._new(label)
        for _ in range(_tries):
            side = int(self.rng.choice(sides))
            pose = self._at_wall(side, asset)
            if pose and (put := self._put(label, look, pose, asset)):
                if asset.bounds[1][2] > _tall:
                    self._hung.append((side, *self._interval(side, put)))
                return put
        return None

    def on_wall(self, label: str, sides: tuple[int, ...] = SIDES) -> Piece | None:
        """Hang a piece on a wall where nothing high stands; None if there is no room."""
        look, asset = self._new(label)
        for _ in range(_tries):
            side = int(self.rng.choice(sides))
            pose = self._at_wall(side, asset)
            if pose is None or self._covered(side, pose, asset):
                continue
            piece = Piece(label, look, pose)
            self._hung.append((side, *self._interval(side, piece)))
            self.pieces.append(piece)
            return piece
        return None

    def in_middle(self, label: str, margin: float = 0.5) -> Piece | None:
        """Stand a piece away from the walls, along one of the axes; None if there is no room."""
        look, asset = self._new(label)
        x0, y0, x1, y1 = self.room.floor
        for _ in range(_tries):
            yaw = _yaw[int(self.rng.integers(4))]
            low, high = _extent(Pose2(0, 0, yaw), asset)
            spread = (
                x1 - x0 - high[0] + low[0] - 2 * margin,
                y1 - y0 - high[1] + low[1] - 2 * margin,
            )
            if min(spread) < 0:
                continue
            x, y = (s * self.rng.random() for s in spread)
            pose = Pose2(x0 + margin - low[0] + x, y0 + margin - low[1] + y, yaw)
            if put := self._put(label, look, pose, asset):
                return put
        return None

    def before(self, piece: Piece, label: str, gap: float, turn: float = math.pi) -> Piece | None:
        """Stand a piece in front of another, turned towards it; None if there is no room."""
        look, asset = self._new(label)
        other = make_furniture(piece.label, piece.look)
        reach = float(other.bounds[1][0]) + gap
        aside = self.rng.uniform(-0.15, 0.15)
        pose = piece.pose @ Pose2(reach, aside, turn + self.rng.normal(0, 0.25))
        return self._put(label, look, pose, asset)

    def stand(self, label: str, pose: Pose2) -> Piece | None:
        """Stand a piece exactly there; None if there is no room."""
        look, asset = self._new(label)
        return self._put(label, look, pose, asset)

    def hang(self, label: str, pose: Pose2) -> None:
        """Hang a piece exactly there, whatever is below."""
        self.pieces.append(Piece(label, self._new(label)[0], pose))

    def _new(self, label: str) -> tuple[int, Asset]:
        look = int(self.rng.integers(2**31))
        return look, make_furniture(label, look)

    def _put(self, label: str, look: int, pose: Pose2, asset: Asset) -> Piece | None:
        low, high = _extent(pose, asset)
        taken = (low[0], low[1], high[0], high[1])
        inside = all(self.room.holds(x, y) for x, y in (low, high))
        if not inside or any(overlap(taken, other) for other in self.blocked + self._kept_free):
            return None
        self.blocked.append(taken)
        self.pieces.append(Piece(label, look, pose))
        return self.pieces[-1]

    def _at_wall(self, side: int, asset: Asset) -> Pose2 | None:
        """A pose with the back at a wall, somewhere along it."""
        low, high = asset.bounds
        long = float(high[1] - low[1])
        begin, end = (turned(side, *self.room.floor[i : i + 2])[0] for i in (0, 2))
        if end - begin < long + 0.03:
            return None
        along = self.rng.uniform(begin + long / 2 + 0.01, end - long / 2 - 0.01)
        inward = 1 if side in (0, 3) else -1
        wall = turned(side, *self.room.floor[:2] if inward > 0 else self.room.floor[2:])[1]
        x, y = turned(side, along, wall + inward * (0.012 - float(low[0])))
        return Pose2(x, y, _yaw[side])

    def _interval(self, side: int, piece: Piece) -> tuple[float, float]:
        low, high = _extent(piece.pose, make_furniture(piece.label, piece.look))
        return turned(side, *low)[0], turned(side, *high)[0]

    def _covered(self, side: int, pose: Pose2, asset: Asset) -> bool:
        low, high = _extent(pose, asset)
        begin, end = turned(side, *low)[0], turned(side, *high)[0]
        return any(s == side and begin < e and b < end for s, b, e in self._hung)

    def _keep_free(self, door: Rectangle) -> None:
        x0, y0, x1, y1 = door
        self._kept_free.append(
            (x0 - _before_door, y0 - _before_door, x1 + _before_door, y1 + _before_door)
        )
        for side in SIDES:
            near = turned(side, *self.room.floor[:2] if side in (0, 3) else self.room.floor[2:])[1]
            if any(abs(turned(side, *door[i : i + 2])[1] - near) < 1e-6 for i in (0, 2)):
                begin, end = turned(side, x0, y0)[0], turned(side, x1, y1)[0]
                self._hung.append((side, begin - 0.1, end + 0.1))


def _extent(pose: Pose2, asset: Asset) -> tuple[tuple[float, float], tuple[float, float]]:
    """Lowest and highest x, y of a piece at a pose [m]."""
    (a0, b0, _), (a1, b1, _) = (bound.tolist() for bound in asset.bounds)
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    corners = [(c * a - s * b, s * a + c * b) for a in (a0, a1) for b in (b0, b1)]
    xs, ys = zip(*corners, strict=True)
    return (pose.x + min(xs), pose.y + min(ys)), (pose.x + max(xs), pose.y + max(ys))
