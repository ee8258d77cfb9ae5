"""Walls around rectangles of free floor."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sim.scenes.model import Wall

Rectangle = tuple[float, float, float, float]
"""x0, y0, x1, y1 [m]."""

WALL = 0.2
"""Thickness of all walls, and so the length of a doorway [m]."""


def walls_around(floor: Sequence[Rectangle]) -> tuple[Wall, ...]:
    """Walls on every side of the floor that leads to no other part of it.

    The rectangles must lie `WALL` apart where there is a wall between them, and touch where there
    is none.
    """
    xs, ys = _cuts(floor, 0), _cuts(floor, 1)
    centers = np.stack(np.meshgrid(_middles(xs), _middles(ys)), axis=-1)
    solid = _within(centers, [_grown(one) for one in floor]) & ~_within(centers, floor)
    return tuple(_wall(block, xs, ys) for block in _blocks(solid))


def _cuts(floor: Sequence[Rectangle], axis: int) -> list[float]:
    """All coordinates at which free floor or a wall begins or ends."""
    ends = {side for one in floor for side in (one[axis], one[axis + 2])}
    grown = {side for one in floor for side in (one[axis] - WALL, one[axis + 2] + WALL)}
    return sorted({round(side, 6) for side in ends | grown})


def _middles(cuts: list[float]) -> NDArray[np.float64]:
    return np.array([(a + b) / 2 for a, b in itertools.pairwise(cuts)])


def _grown(one: Rectangle) -> Rectangle:
    return one[0] - WALL, one[1] - WALL, one[2] + WALL, one[3] + WALL


def _within(points: NDArray[np.float64], floor: Sequence[Rectangle]) -> NDArray[np.bool_]:
    x, y = points[..., 0], points[..., 1]
    inside = np.zeros(x.shape, np.bool_)
    for x0, y0, x1, y1 in floor:
        inside |= (x > x0) & (x < x1) & (y > y0) & (y < y1)
    return inside


def _blocks(solid: NDArray[np.bool_]) -> list[tuple[int, int, int, int]]:
    """Rectangles of cells (column, row, end column, end row) that cover `solid` once."""
    left, found = solid.copy(), list[tuple[int, int, int, int]]()
    while left.any():
        row, column = (int(index[0]) for index in np.nonzero(left))
        end = column + int(np.argmin(np.append(left[row, column:], False)))
        last = row + 1
        while last < len(left) and left[last, column:end].all():
            last += 1
        left[row:last, column:end] = False
        found.append((column, row, end, last))
    return found


def _wall(block: tuple[int, int, int, int], xs: list[float], ys: list[float]) -> Wall:
    """A block as a wall along its longer side."""
    x0, y0, x1, y1 = xs[block[0]], ys[block[1]], xs[block[2]], ys[block[3]]
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    if x1 - x0 >= y1 - y0:
        return Wall(start=(x0, y), end=(x1, y), thickness=round(y1 - y0, 6))
    return Wall(start=(x, y0), end=(x, y1), thickness=round(x1 - x0, 6))
