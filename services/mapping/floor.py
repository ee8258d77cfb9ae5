"""Free ground as the range finder knows it: between which places one can go without a doorway."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from schemas.arrays import Flags, Floats
from services.mapping.grid import Grid

occupied_from, _free = 0.5, -0.5
"""Log odds from which a cell counts as one or the other."""
_margin = 3.0
_wide = 2.0
"""More clearance than this makes no difference [m]."""
_narrow = 0.75
"""A way that narrows to less than this share of what both its ends have passes a doorway."""
_doorway = 0.85
"""Half the width of doorways, at most [m]."""
_roomy = 0.9
"""Less clearance than this near a place may be a doorway's [m]."""
_end = 0.5
_directions = np.array([[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1]], np.float64)
_samples = 26
_unknown_share = 0.2


@dataclass(frozen=True)
class Floor:
    """A window of the grid."""

    origin: Floats
    """Map coordinates of the corner of cell (0, 0), shape (2,) [m]."""
    resolution: float
    """Side of the cells [m]."""
    free: Flags
    """(Y, X)"""
    occupied: Flags
    """(Y, X)"""
    clearance: Floats
    """(Y, X) to the nearest obstacle, at most `_wide` [m]."""

    def open_between(self, starts: Floats, ends: Floats) -> Flags:
        """Whether places (n, 2) and (n, 2) share one open space: no wall, no doorway between."""
        share = np.linspace(0.0, 1.0, _samples)[:, None]
        row, column = self._cells(starts[:, None] + share * (ends - starts)[:, None])
        clear = self.clearance[row, column]
        narrow = clear.min(axis=1) < _narrow * np.minimum(clear[:, 0], clear[:, -1])
        unknown = np.mean(~self.free[row, column], axis=1) > _unknown_share
        return ~(narrow | unknown | self.occupied[row, column].any(axis=1))

    def wide_between(self, starts: Floats, ends: Floats) -> Flags:
        """Whether the ways between places (n, 2) and (n, 2) are as wide as no doorway is.

        Next to a wall it is narrow too; there the room beside the place counts.
        """
        share = np.linspace(0.0, 1.0, _samples)[:, None]
        step = (ends - starts)[:, None]
        clear = self.clearance[self._cells(starts[:, None] + share * step)]
        way = share[:, 0] * np.linalg.norm(step, axis=2)
        inner = (way > _end) & (way[:, ::-1] > _end)
        room = np.minimum(self._room(starts), self._room(ends))
        return (np.where(inner, clear, np.inf).min(axis=1) > _doorway) & (room > _roomy)

    def _room(self, points: Floats) -> Floats:
        """Most clearance (n,) that there is within a step of points (n, 2) [m]."""
        around = points[:, None] + _end * _directions
        return self.clearance[self._cells(around)].max(axis=1)

    def coarse(self, layer: Flags, side: float) -> Flags:
        """A layer in blocks of `side`, a multiple of the grid's: shape (Y', s, X', s)."""
        step = round(side / self.resolution)
        rows, columns = (size // step for size in layer.shape)
        return layer[: rows * step, : columns * step].reshape(rows, step, columns, step)

    def _cells(self, points: Floats) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns of points (..., 2); those outside count as at the edge."""
        cells = np.floor((points - self.origin) / self.resolution).astype(np.intp)
        rows, columns = self.free.shape
        return np.clip(cells[..., 1], 0, rows - 1), np.clip(cells[..., 0], 0, columns - 1)


def floor_around(points: Floats, grid: Grid) -> Floor:
    """The floor around points (n, 2)."""
    limit, resolution = np.array(grid.occupancy.shape[::-1]), grid.resolution
    low = np.floor((points.min(axis=0) - _margin - grid.origin) / resolution).astype(int)
    high = np.ceil((points.max(axis=0) + _margin - grid.origin) / resolution).astype(int)
    (left, down), (right, up) = np.clip(low, 0, limit - 1), np.clip(high, 1, limit)
    layer = grid.occupancy[down:up, left:right]
    occupied: Flags = layer > occupied_from
    distance = np.full(layer.shape, _wide)
    if occupied.any():
        distance = np.asarray(ndimage.distance_transform_edt(~occupied)) * resolution
    origin = grid.origin + resolution * np.array([left, down])
    return Floor(origin, resolution, layer < _free, occupied, np.minimum(distance, _wide))
