"""How far one sees among walls."""

import math

import numpy as np

from schemas.arrays import Flags, Floats
from schemas.geometry import Pose2
from sim.scenes.model import Wall

_parallel = 1e-12


class Walls:
    """The sides of all walls as E straight edges, for rays on the floor."""

    def __init__(self, walls: tuple[Wall, ...]) -> None:
        edges = [edge for wall in walls for edge in _edges(wall)]
        self._start = np.array([start for start, _ in edges]).reshape(-1, 2)
        self._along = np.array([end for _, end in edges]).reshape(-1, 2) - self._start

    def reach(self, world_from_base: Pose2, bearings: Floats) -> Floats:
        """Free distance (N,) from the base in directions (N,) of its frame [m], infinite if open.

        For any ray o + t d and edge a + s e, t = (a - o) x e / (d x e), s = (a - o) x d / (d x e).
        """
        angles = world_from_base.yaw + bearings
        direction = np.column_stack([np.cos(angles), np.sin(angles)])[:, None]
        offset = self._start - (world_from_base.x, world_from_base.y)
        across = _cross(direction, self._along)
        across = np.where(np.abs(across) < _parallel, np.nan, across)
        t = _cross(offset, self._along) / across
        s = _cross(offset, direction) / across
        hit = (t > 0) & (s >= 0) & (s <= 1)
        return np.where(hit, t, np.inf).min(axis=1, initial=math.inf)

    def in_sight(self, world_from_base: Pose2, points_base: Floats) -> Flags:
        """Whether no wall stands between the base and points (N, 2) of its frame."""
        bearings = np.arctan2(points_base[:, 1], points_base[:, 0])
        return np.hypot(*points_base.T) < self.reach(world_from_base, bearings)


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _edges(wall: Wall) -> list[tuple[Floats, Floats]]:
    start, end = np.array(wall.start), np.array(wall.end)
    along = (end - start) / np.linalg.norm(end - start)
    side = wall.thickness / 2 * np.array([-along[1], along[0]])
    corners = [start + side, start - side, end - side, end + side]
    return list(zip(corners, corners[1:] + corners[:1], strict=True))
