"""The occupancy grid as pictures for the floor."""

import numpy as np

from schemas.arrays import Bytes
from schemas.belief import OccupancyGrid

_free = (250, 250, 252, 255)
_unknown = (250, 250, 252, 0)
"""Clear, and yet light: the browser blends the colours of neighbouring cells."""
_occupied = (52, 58, 70, 255)
_tint = (0, 158, 115)
_sharp = 0.07
"""Size of a texel from which on cells look crisp [m]."""
_strongest_tint = 90.0
_sure = 5
"""Log odds, in tenths, from which a cell counts as free or occupied."""


def occupancy_picture(grid: OccupancyGrid) -> Bytes:
    """RGBA (Y, X, 4): obstacles dark, free floor nearly white, the unknown left out."""
    picture = np.full((*grid.occupancy.shape, 4), _unknown, np.uint8)
    picture[grid.occupancy <= -_sure] = _free
    picture[grid.occupancy >= _sure] = _occupied
    return picture


def looked_picture(grid: OccupancyGrid) -> Bytes:
    """RGBA (Y, X, 4): tint where the camera looked and found nothing, by how sure that is."""
    miss = np.exp(grid.looked.astype(np.float64) / 10)
    picture = np.empty((*grid.looked.shape, 4), np.uint8)
    picture[..., :3] = _tint
    picture[..., 3] = np.round(_strongest_tint * (1 - np.minimum(miss, 1.0)))
    picture[grid.occupancy >= _sure, 3] = 0
    return picture


def magnified(picture: Bytes, resolution: float) -> Bytes:
    """The picture with coarse cells split up, so that the browser's blending keeps their edges."""
    times = int(np.clip(round(resolution / _sharp), 1, 3))
    return picture.repeat(times, axis=0).repeat(times, axis=1)


def size_m(grid: OccupancyGrid) -> tuple[float, float]:
    """Extent of the grid along x and y [m]."""
    rows, columns = grid.occupancy.shape
    return columns * grid.resolution, rows * grid.resolution


def center(grid: OccupancyGrid) -> tuple[float, float]:
    """Map coordinates of the middle of the grid [m]."""
    width, height = size_m(grid)
    return grid.origin[0] + width / 2, grid.origin[1] + height / 2
