"""What an object stands on: the ground, or a table.

Just below an object and beside its foot the picture shows what bears it. Where these points lie
level, that is the support; else it is the ground.
"""

import numpy as np

from schemas.arrays import Floats
from services.perception.space.rays import CameraRays

_below, _beside = 0.35, 0.3
"""How far the rim reaches below and beside the foot of a box, in its height and width."""
_foot = 0.2
"""Lower part of a box that the rim lies beside, in its height."""
_least_points = 8
_level = (0.012, 0.008)
"""Deviation of heights that still is level: always [m], and for each metre of range [m/m]."""
_least_height = 0.12
"""Lower than this it is the ground itself, seen from a base that pitches [m]."""


def support_height(box: Floats, depth: Floats, rays: CameraRays, step: int = 1) -> float:
    """Height [m] in the base frame of what the object in a box (4,) [px] stands on.

    One of `step` pixels is read in each direction.
    """
    rows, columns = _rim(box, depth.shape, step)
    seen = depth[rows, columns]
    points = rays.origin + rays.directions[rows, columns] * seen[:, None]
    heights = points[seen > 0, 2]
    if len(heights) < _least_points:
        return 0.0
    low, middle, high = np.percentile(heights, [20, 50, 80]).tolist()
    level = (high - low) / 2 <= _level[0] + _level[1] * float(np.median(seen[seen > 0]))
    return float(middle) if level and middle > _least_height else 0.0


def _rim(box: Floats, shape: tuple[int, ...], step: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of the pixels below the box and on both sides of its foot."""
    x0, y0, x1, y1 = box.tolist()
    width, height = x1 - x0, y1 - y0
    below = _pixels(x0, y1 + 1, x1, y1 + 2 + _below * height, shape, step)
    foot = y1 - _foot * height
    left = _pixels(x0 - 1 - _beside * width, foot, x0 - 1, y1, shape, step)
    right = _pixels(x1 + 1, foot, x1 + 1 + _beside * width, y1, shape, step)
    rows, columns = np.concatenate([below, left, right], axis=1)
    return rows, columns


def _pixels(
    x0: float, y0: float, x1: float, y1: float, shape: tuple[int, ...], step: int
) -> np.ndarray:
    """(2, N) rows and columns of the pixels of a rectangle that are in the picture."""
    rows = np.arange(max(int(y0), 0), min(int(y1) + 1, shape[0]), step)
    columns = np.arange(max(int(x0), 0), min(int(x1) + 1, shape[1]), step)
    return np.stack([grid.ravel() for grid in np.meshgrid(rows, columns, indexing="ij")])
