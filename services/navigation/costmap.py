"""What a metre of driving costs in each place, from the range finder's grid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from robots.spec import BaseGeometry
from schemas.arrays import Flags, Floats, SignedBytes
from schemas.belief import OccupancyGrid

occupied_above = 5
"""Log odds in tenths above which a cell is an obstacle."""

_margin = 6.0
"""How far a way round may lead outside the box of start and goal [m]."""
_comfort = 0.6
"""Beyond the footprint plus this, obstacles cost nothing [m]."""
_comfort_cost = 3.0
_cramped_cost = 4.0
"""Added per metre where the base fits but cannot turn: a base that stops there may be caught."""
_footprint_margin = 0.05
_unknown_cost = 1.0
"""Added per metre where nothing was measured: passable, but second choice."""
_escape_cost = 20.0
_escape_radius = 0.8
"""A base that stands too near an obstacle may still drive out of it [m]."""


@dataclass(frozen=True)
class Room:
    """Distances from obstacles that a base needs."""

    passage: float
    """To drive [m]."""
    turning: float
    """To turn on the spot, at least `passage` [m]."""

    @staticmethod
    def of(base: BaseGeometry) -> "Room":
        """With some margin, for cells are coarse."""
        passage = base.passage_radius + _footprint_margin
        turning = base.radius + base.margin + _footprint_margin
        return Room(passage, passage if base.turns_anywhere else turning)


@dataclass(frozen=True)
class Costmap:
    """Cost per metre of cells around start and goal, map frame."""

    origin: Floats
    """Map coordinates of the corner of cell (0, 0), shape (2,) [m]."""
    resolution: float
    """[m]"""
    cost: Floats
    """(Y, X), at least 1; infinite where the base does not fit."""
    cramped: Flags
    """(Y, X) Where the base cannot turn, though it may fit."""

    def cell(self, point: Floats) -> tuple[int, int]:
        """Row and column of the cell that holds a point (2,) [m], clipped to the map."""
        column, row = np.floor((point - self.origin) / self.resolution).astype(int).tolist()
        rows, columns = self.cost.shape
        return min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)

    def centers(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Floats:
        """Map coordinates of cell centres, shape (N, 2) [m]."""
        return self.origin + (np.stack([columns, rows], axis=-1) + 0.5) * self.resolution

    def cost_along(self, points: Floats) -> Floats:
        """Cost per metre at points (N, 2) [m]; infinite outside the map."""
        columns, rows = np.floor((points - self.origin) / self.resolution).astype(int).T
        inside = (rows >= 0) & (rows < self.cost.shape[0])
        inside &= (columns >= 0) & (columns < self.cost.shape[1])
        values = np.full(len(points), np.inf)
        values[inside] = self.cost[rows[inside], columns[inside]]
        return values


def costmap_of(
    grid: OccupancyGrid, start: Floats, goal: Floats, room: Room, everywhere: bool = False
) -> Costmap:
    """Costs in a window around `start` and `goal` (2,).

    With `everywhere` it holds all that was measured too: indoors the way to the other side of a
    wall may lead far away.
    """
    inside = np.stack([start, goal, *(_measured(grid) if everywhere else ())])
    window, origin = _window(grid, inside.min(axis=0) - _margin, inside.max(axis=0) + _margin)
    occupied: Flags = window > occupied_above
    clearance = _clearance(occupied, grid.resolution)
    nearness = np.clip(1.0 - (clearance - room.passage) / _comfort, 0.0, 1.0)
    cost = 1.0 + _comfort_cost * nearness**2 + _unknown_cost * (window == 0)
    cramped: Flags = (clearance < room.turning) & (room.turning > room.passage)
    cost += _cramped_cost * cramped
    cost[clearance < room.passage] = np.inf
    costmap = Costmap(origin, grid.resolution, cost, cramped)
    _open_around(costmap, start, occupied)
    return costmap


def _measured(grid: OccupancyGrid) -> Floats:
    """Two opposite corners of the box around all that was measured, shape (2, 2) [m], or none."""
    rows, columns = np.nonzero(grid.occupancy)
    if not len(rows):
        return np.zeros((0, 2))
    cells = np.array([(columns.min(), rows.min()), (columns.max() + 1, rows.max() + 1)])
    return np.array(grid.origin) + cells * grid.resolution


def _window(grid: OccupancyGrid, lower: Floats, upper: Floats) -> tuple[SignedBytes, Floats]:
    """Cells of the grid between two corners; what the grid does not cover is unknown."""
    corner = np.array(grid.origin)
    first = np.floor((lower - corner) / grid.resolution).astype(int)
    columns, rows = np.ceil((upper - lower) / grid.resolution).astype(int).tolist()
    window = np.zeros((rows, columns), np.int8)
    left, bottom = first.tolist()
    height, width = grid.occupancy.shape
    y0, y1 = max(bottom, 0), min(bottom + rows, height)
    x0, x1 = max(left, 0), min(left + columns, width)
    if y0 < y1 and x0 < x1:
        part = grid.occupancy[y0:y1, x0:x1]
        window[y0 - bottom : y1 - bottom, x0 - left : x1 - left] = part
    return window, corner + first * grid.resolution


def _clearance(occupied: Flags, resolution: float) -> Floats:
    """Distance from each cell's centre to the nearest obstacle's near side, about [m]."""
    if not occupied.any():
        return np.full(occupied.shape, np.inf)
    distance = np.asarray(ndimage.distance_transform_edt(~occupied), np.float64)
    return (distance - 0.5) * resolution


def _open_around(costmap: Costmap, start: Floats, occupied: Flags) -> None:
    rows, columns = np.nonzero(~np.isfinite(costmap.cost) & ~occupied)
    near = np.hypot(*(costmap.centers(rows, columns) - start).T) < _escape_radius
    costmap.cost[rows[near], columns[near]] = _escape_cost
