"""Cheapest path on a costmap, made straight where that costs nothing."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from schemas.arrays import Floats
from services.navigation.costmap import Costmap

goal_slack = 1.0
"""When the goal itself is not free, the nearest reachable place this close will do [m]."""

_step = 0.1
"""Distance between points of a finished path [m]."""
_neighbours = ((0, 1), (1, 0), (1, 1), (1, -1))


class NoPathError(Exception):
    """No place within `goal_slack` of the goal can be reached."""


@dataclass(frozen=True)
class Path:
    """A way to drive, densely sampled."""

    points: Floats
    """(N, 2), from start to end, map frame [m]."""
    cost: float
    """Integral of the costmap along the cells [m at cost 1]."""


def plan(costmap: Costmap, start: Floats, goal: Floats) -> Path:
    """Dijkstra from `start` (2,) to `goal` (2,) or the nearest place that can be reached.

    Raises:
        NoPathError: see its text.
    """
    first = int(np.ravel_multi_index(costmap.cell(start), costmap.cost.shape))
    distances, predecessors = csgraph.dijkstra(
        _graph(costmap), directed=False, indices=first, return_predecessors=True
    )
    last = _nearest_reachable(costmap, distances, goal)
    cells = _trace(predecessors, first, last)
    points = costmap.centers(*np.unravel_index(cells, costmap.cost.shape))
    points[0] = start
    if float(np.hypot(*(points[-1] - goal))) < costmap.resolution and _may_end_at(costmap, goal):
        points[-1] = goal
    return Path(_dense(_straightened(costmap, points)), float(distances[last]))


def _may_end_at(costmap: Costmap, point: Floats) -> bool:
    """Whether the base fits at a point (2,) and can turn there."""
    free = bool(np.isfinite(costmap.cost_along(point[None]))[0])
    return free and not bool(costmap.cramped[costmap.cell(point)])


def is_blocked(costmap: Costmap, path: Floats) -> bool:
    """Whether the base no longer fits somewhere along a path (N, 2)."""
    return not bool(np.isfinite(costmap.cost_along(path)).all())


def _graph(costmap: Costmap) -> sparse.csr_matrix:
    """Undirected graph over the cells; an edge costs its length times the mean of its ends."""
    cost = costmap.cost
    rows, columns = cost.shape
    index = np.arange(cost.size).reshape(cost.shape)
    heads, tails, weights = [], [], []
    for down, across in _neighbours:
        a = (slice(0, rows - down), slice(max(0, -across), columns - max(0, across)))
        b = (slice(down, rows), slice(max(0, across), columns - max(0, -across)))
        length = costmap.resolution * np.hypot(down, across)
        weight = 0.5 * length * (cost[a] + cost[b])
        fits = np.isfinite(weight)
        heads.append(index[a][fits])
        tails.append(index[b][fits])
        weights.append(weight[fits])
    ends = (np.concatenate(heads), np.concatenate(tails))
    return sparse.csr_matrix((np.concatenate(weights), ends), shape=(cost.size, cost.size))


def _nearest_reachable(costmap: Costmap, distances: Floats, goal: Floats) -> int:
    cells = np.flatnonzero(np.isfinite(distances))
    centers = costmap.centers(*np.unravel_index(cells, costmap.cost.shape))
    to_goal = np.hypot(*(centers - goal).T)
    best = int(np.argmin(to_goal))
    if to_goal[best] > goal_slack:
        raise NoPathError(
            f"the nearest place that can be reached is {to_goal[best]:.1f} m from the goal, "
            f"allowed are {goal_slack:.1f} m"
        )
    return int(cells[_roomiest(costmap, cells, to_goal, best)])


def _roomiest(costmap: Costmap, cells: NDArray[np.intp], to_goal: Floats, best: int) -> int:
    """The nearest to the goal of the cells in which the base can turn, if one will do."""
    gaps = np.where(costmap.cramped.flat[cells], np.inf, to_goal)
    roomy = int(np.argmin(gaps))
    return roomy if gaps[roomy] <= goal_slack else best


def _trace(predecessors: np.ndarray, first: int, last: int) -> list[int]:
    cells = [last]
    while cells[-1] != first:
        cells.append(int(predecessors[cells[-1]]))
    return cells[::-1]


def _straightened(costmap: Costmap, points: Floats) -> Floats:
    """Leave out points wherever the straight way is no dearer than the way over the cells."""
    kept = [0]
    while kept[-1] < len(points) - 1:
        kept.append(_furthest_straight(costmap, points, kept[-1]))
    return points[kept]


def _furthest_straight(costmap: Costmap, points: Floats, start: int) -> int:
    jump = len(points) - 1 - start
    while jump > 1:
        end = start + jump
        straight = _integral(costmap, points[[start, end]])
        # Where the way itself touches what is not free, that is no reason to go right through.
        if np.isfinite(straight) and straight <= _integral(costmap, points[start : end + 1]) + 1e-6:
            return end
        jump = jump * 2 // 3
    return start + 1


def _integral(costmap: Costmap, corners: Floats) -> float:
    points = _dense(corners)
    lengths = np.hypot(*np.diff(points, axis=0).T)
    return float(lengths @ costmap.cost_along(0.5 * (points[1:] + points[:-1])))


def _dense(corners: Floats) -> Floats:
    """The same polyline with a point at least every `_step`."""
    pieces = [corners[:1]]
    for a, b in pairwise(corners):
        count = max(1, int(np.ceil(np.hypot(*(b - a)) / _step)))
        shares = np.arange(1, count + 1)[:, None] / count
        pieces.append(a + shares * (b - a))
    return np.concatenate(pieces)
