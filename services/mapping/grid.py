"""What the range finder saw and where the camera has looked, as one growing grid."""

import math

import numpy as np

from schemas.arrays import Flags, Floats, Floats32, Ints, SignedBytes
from schemas.belief import OccupancyGrid
from schemas.geometry import Pose2
from schemas.sensing import LaserScan

_half_side = 30.0
_margin = 20.0
_free_range = 15.0
_hit, _pass, _limit = 0.9, -0.4, 6.0
_tenths = 10.0


class Grid:
    """Log odds of occupancy, and log probability of having missed an object, for each cell.

    Args:
        center: map coordinates around which the first 60 m square lies.
        resolution: side of the cells [m].
    """

    def __init__(self, center: tuple[float, float], resolution: float = 0.2) -> None:
        self.resolution = resolution
        cells = round(2 * _half_side / resolution)
        corner = np.floor(np.array(center) / resolution) * resolution - _half_side
        self.origin: Floats = corner
        self.occupancy: Floats32 = np.zeros((cells, cells), np.float32)
        self.looked: Floats32 = np.zeros((cells, cells), np.float32)
        """Of missing a thing of the classes that are asked for."""
        self._looked_for_all: Floats32 = np.zeros((cells, cells), np.float32)
        """Of missing a thing of any class: by pictures that were searched for all of them."""

    def insert(self, scan: LaserScan, map_from_base: Pose2) -> None:
        """Ray casting: cells that beams crossed are free, cells where they ended are not."""
        laser = map_from_base @ scan.base_from_laser
        self.cover(laser.x, laser.y)
        rows, columns = self._ends(scan, laser)
        window, distance, bearing = self.around(laser, min(scan.range_max, _free_range))
        beam = np.rint((bearing - scan.angle_min) / scan.angle_increment).astype(np.int32)
        reach = np.minimum(np.nan_to_num(scan.ranges), scan.range_max)[beam % len(scan.ranges)]
        crossed = distance < np.minimum(reach - self.resolution, _free_range)
        layer = self.occupancy
        before = layer[rows, columns]
        layer[window][crossed] += _pass
        layer[rows, columns] = before + _hit
        np.clip(layer, -_limit, _limit, out=layer)

    def look(
        self,
        map_from_base: Pose2,
        reach: float,
        miss: Floats32,
        floor: Floats32,
        for_all: bool = True,
    ) -> None:
        """Add a picture's log miss probabilities, as shaped by `around`, no lower than `floor`.

        The picture was searched for what is asked for, and for all classes if `for_all`.
        """
        window, _, _ = self.around(map_from_base, reach)
        for layer in (self.looked, self._looked_for_all) if for_all else (self.looked,):
            part = layer[window]
            np.minimum(part, np.maximum(part + miss, floor), out=part)

    def ask_anew(self) -> None:
        """Other classes are asked for: what was looked for others alone says nothing of them."""
        self.looked = self._looked_for_all.copy()

    def around(self, center: Pose2, reach: float) -> tuple[tuple[slice, slice], Floats, Floats]:
        """Window of cells within reach, and their distances [m] and bearings in that frame."""
        self.cover(center.x, center.y)
        column, row = self._cell(np.array([center.x, center.y])).tolist()
        n = math.ceil(reach / self.resolution)
        steps = np.arange(-n, n + 1) + 0.5
        x = self.origin[0] + (column + steps) * self.resolution - center.x
        y = self.origin[1] + (row + steps) * self.resolution - center.y
        bearing = np.arctan2(y[:, None], x[None, :]) - center.yaw
        window = (slice(row - n, row + n + 1), slice(column - n, column + n + 1))
        return window, np.hypot(y[:, None], x[None, :]), _wrapped(bearing)

    def looked_at(self, points: Floats) -> Floats:
        """Log probability of having missed an object at each point (..., 2); 0 outside."""
        cells = self._cell(points)
        column, row = cells[..., 0], cells[..., 1]
        inside = self._inside(row, column)
        values = self.looked[np.where(inside, row, 0), np.where(inside, column, 0)]
        return np.where(inside, values, 0.0).astype(np.float64)

    def cover(self, x: float, y: float) -> None:
        """Grow so that the surroundings of a place lie inside."""
        top = self.origin + self.resolution * np.array(self.occupancy.shape[::-1])
        place, side = np.array([x, y]), self.resolution
        low = np.maximum(0, np.ceil((self.origin - (place - _margin)) / side))
        high = np.maximum(0, np.ceil((place + _margin - top) / side))
        if not low.any() and not high.any():
            return
        (left, down), (right, up) = low.astype(int).tolist(), high.astype(int).tolist()
        padding = ((down, up), (left, right))
        self.occupancy = np.pad(self.occupancy, padding)
        self.looked = np.pad(self.looked, padding)
        self._looked_for_all = np.pad(self._looked_for_all, padding)
        self.origin = self.origin - side * np.array([left, down])

    def message(self, stamp_ns: int) -> OccupancyGrid:
        """The grid as it is published."""
        return OccupancyGrid(
            stamp_ns=stamp_ns,
            origin=(float(self.origin[0]), float(self.origin[1])),
            resolution=self.resolution,
            occupancy=_as_tenths(self.occupancy),
            looked=_as_tenths(self.looked),
            looked_for_all=bool(np.array_equal(self.looked, self._looked_for_all)),
        )

    def restore(self, message: OccupancyGrid) -> None:
        """Take up a published grid."""
        self.origin, self.resolution = np.array(message.origin), message.resolution
        self.occupancy = (message.occupancy / _tenths).astype(np.float32)
        self.looked = (message.looked / _tenths).astype(np.float32)
        for_all = self.looked if message.looked_for_all else np.zeros_like(self.looked)
        self._looked_for_all = for_all.copy()

    def _ends(self, scan: LaserScan, laser: Pose2) -> tuple[Ints, Ints]:
        hit = np.isfinite(scan.ranges) & (scan.ranges > 0) & (scan.ranges < scan.range_max)
        ranges = scan.ranges[hit].astype(np.float64)
        angles = scan.angle_min + scan.angle_increment * np.flatnonzero(hit)
        points = laser.apply(np.stack([ranges * np.cos(angles), ranges * np.sin(angles)], axis=1))
        cells = self._cell(points)
        inside = self._inside(cells[:, 1], cells[:, 0])
        return cells[inside, 1], cells[inside, 0]

    def _cell(self, points: Floats) -> Ints:
        return np.floor((points - self.origin) / self.resolution).astype(np.int32)

    def _inside(self, row: Ints, column: Ints) -> Flags:
        rows, columns = self.occupancy.shape
        return (row >= 0) & (row < rows) & (column >= 0) & (column < columns)


def _wrapped(angle: Floats) -> Floats:
    return (angle + np.pi) % (2 * np.pi) - np.pi


def _as_tenths(layer: Floats32) -> SignedBytes:
    return np.rint(layer * _tenths).astype(np.int8)
