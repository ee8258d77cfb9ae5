"""The grid as the policy needs it: where to stand, what hides what, where nobody has looked."""

from dataclasses import dataclass, replace

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from schemas.arrays import Flags, Floats
from schemas.belief import OccupancyGrid

block_size = 0.4
"""The policy thinks in blocks of about this size [m]."""

_occupied_above = 5
"""Log odds in tenths."""
_hides_from = 1.2
"""Obstacles at least this wide hide what is behind them; the camera looks over the others [m]."""
_unlooked_above = 0.75
"""Probability of having missed an object here, above which nobody has really looked."""
_known_share = 0.5
"""Share of a block's cells that was measured, from which on the block is known."""
_coarse_from = 0.6
"""A base of this radius passes nothing that blocks would close [m]."""
_strip = 3.0
"""Unknown ground that is kept around what is known [m]."""
_ray_margin = 0.6
"""A ray ends this far before its target, which may be an obstacle itself [m]."""


@dataclass(frozen=True)
class Terrain:
    """Blocks of the grid, map frame."""

    origin: Floats
    """Corner of block (0, 0), shape (2,) [m]."""
    resolution: float
    """[m]"""
    occupied: Flags
    """(Y, X)"""
    clearance: Floats
    """(Y, X) Distance to the nearest obstacle, about [m]."""
    hides: Flags
    """(Y, X) Part of an obstacle that is wide enough to hide things."""
    missed: Floats
    """(Y, X) Probability that an object here would have been missed so far."""
    unlooked: Floats
    """(Y, X) Free ground that nobody has looked at [m^2]."""
    known: Flags
    """(Y, X) Ground that the range finder measured."""

    def blocks(self, points: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp], Flags]:
        """Rows and columns of points (..., 2), clipped, and whether they are on the map."""
        scaled = np.floor((points - self.origin) / self.resolution).astype(np.intp)
        rows, columns = self.occupied.shape
        inside: Flags = np.all((scaled >= 0) & (scaled < (columns, rows)), axis=-1)
        row = np.clip(scaled[..., 1], 0, rows - 1)
        return row, np.clip(scaled[..., 0], 0, columns - 1), inside

    def centers(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Floats:
        """Map coordinates of block centres (N, 2) [m]."""
        return self.origin + (np.stack([columns, rows], axis=-1) + 0.5) * self.resolution

    def missed_at(self, points: Floats) -> Floats:
        """Probability that an object at points (N, 2) would have been missed so far."""
        row, column, inside = self.blocks(points)
        return np.where(inside, self.missed[row, column], 1.0)

    def clearance_at(self, points: Floats) -> Floats:
        """Distance from points (N, 2) to the nearest obstacle [m]."""
        row, column, inside = self.blocks(points)
        return np.where(inside, self.clearance[row, column], np.inf)

    def in_sight(self, eyes: Floats, targets: Floats) -> Flags:
        """Whether nothing wide stands between eyes (N, 2) and targets (N, 2)."""
        if len(eyes) == 0 or not self.hides.any():
            return np.ones(len(eyes), bool)
        span = targets - eyes
        length = np.hypot(span[:, 0], span[:, 1])
        reach = np.maximum(length - _ray_margin, 0.0)
        step = self.resolution  # Longer steps would leap over walls, which are one block thick.
        distances = np.arange(step, reach.max() + step, step)
        along = np.minimum(distances, reach[:, None]) / np.maximum(length, 1e-9)[:, None]
        row, column, inside = self.blocks(eyes[:, None] + along[..., None] * span[:, None])
        hidden: Flags = np.any(self.hides[row, column] & inside, axis=1)
        return ~hidden


def terrain_for(grid: OccupancyGrid, radius: float) -> Terrain:
    """Terrain in which ways for a base of `radius` [m] can be found.

    A narrow base gets through doors that coarse blocks would close: it needs the grid's own cells.
    These are many, so the rim of the grid that no sensor reached is left out. What lies beyond a
    door is not known to be free before one looks there: nobody has looked at unknown ground.
    """
    if radius >= _coarse_from:
        return terrain_of(grid)
    terrain = terrain_of(_measured_part(grid), grid.resolution)
    unknown = ~terrain.known & ~terrain.occupied
    return replace(terrain, unlooked=terrain.unlooked + unknown * terrain.resolution**2)


def _measured_part(grid: OccupancyGrid) -> OccupancyGrid:
    """The grid without the rim that no sensor reached, but for a narrow strip of it."""
    rows, columns = np.nonzero((grid.occupancy != 0) | (grid.looked != 0))
    if not len(rows):
        return grid
    strip = round(_strip / grid.resolution)
    top, left = max(int(rows.min()) - strip, 0), max(int(columns.min()) - strip, 0)
    window = (slice(top, int(rows.max()) + strip), slice(left, int(columns.max()) + strip))
    corner = (left * grid.resolution, top * grid.resolution)
    return msgspec.structs.replace(
        grid,
        origin=(grid.origin[0] + corner[0], grid.origin[1] + corner[1]),
        occupancy=grid.occupancy[window],
        looked=grid.looked[window],
    )


def terrain_of(grid: OccupancyGrid, block: float = block_size) -> Terrain:
    """Blocks [m] of a grid, which keeps its own cells if they are not finer."""
    step = max(1, round(block / grid.resolution))
    resolution = step * grid.resolution
    occupancy = _in_blocks(grid.occupancy, step)
    looked = _in_blocks(grid.looked, step)
    occupied: Flags = np.any(occupancy > _occupied_above, axis=0)
    missed = np.exp(0.1 * looked.mean(axis=0))
    free_share = (occupancy < 0).mean(axis=0)
    return Terrain(
        origin=np.array(grid.origin),
        resolution=resolution,
        occupied=occupied,
        clearance=_clearance(occupied, resolution),
        hides=_wide_parts(occupied, resolution),
        missed=missed,
        unlooked=free_share * (missed > _unlooked_above) * ~occupied * resolution**2,
        known=(occupancy != 0).mean(axis=0) >= _known_share,
    )


def _in_blocks(cells: NDArray[np.int8], step: int) -> NDArray[np.int8]:
    """Shape (step * step, Y, X), the cells of a block first; what the last ones lack is unknown."""
    rows, columns = (-(-size // step) for size in cells.shape)
    padded = np.zeros((rows * step, columns * step), np.int8)
    padded[: cells.shape[0], : cells.shape[1]] = cells
    return np.stack([padded[i::step, j::step] for i in range(step) for j in range(step)])


def _clearance(occupied: Flags, resolution: float) -> Floats:
    if not occupied.any():
        return np.full(occupied.shape, np.inf)
    distance = np.asarray(ndimage.distance_transform_edt(~occupied), np.float64)
    return (distance - 0.5) * resolution


def _wide_parts(occupied: Flags, resolution: float) -> Flags:
    labels = np.zeros(occupied.shape, np.int32)
    ndimage.label(occupied, structure=np.ones((3, 3)), output=labels)
    wide = np.zeros(int(labels.max()) + 1, bool)
    for label, (rows, columns) in enumerate(ndimage.find_objects(labels), start=1):
        size = max(rows.stop - rows.start, columns.stop - columns.start)
        wide[label] = size * resolution > _hides_from
    return wide[labels]
