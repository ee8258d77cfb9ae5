"""What the camera could have seen: the evidence in not seeing something.

The ground in front of the robot is divided into cells by bearing and range. A cell is seen where
the depth image shows the ground itself, and hidden where the pixel that should show it shows
something nearer. Along each bearing the view ends at the first cell that is not seen.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Floats, Ints
from schemas.geometry import Pose3
from schemas.sensing import Intrinsics
from services.perception.space.rays import camera_rays

bearings_count = 32
_range_step = 0.25
_hidden_share = 0.3
"""A cell is hidden when this part of its measured pixels is on something in front of it."""
_measured_share = 0.25
"""A cell is unseen when less than this part of its pixels was measured at all."""
_height_tolerance = 0.08
_berth = 0.5
"""Before things that are passed over [m]."""
_slope_tolerance = 0.012
"""The base pitches a little when it drives; ground then seems to rise with the distance [m/m]."""


@dataclass(frozen=True)
class GroundView:
    """How far the ground was seen, by bearing, in the base frame."""

    bearings: Floats
    """(V,) ascending [rad]."""
    ranges: Floats
    """(V,) from the base's origin [m]."""
    near: float
    """Closer than this no ground is in the picture [m]."""

    def without(self, left: Floats, right: Floats) -> "GroundView":
        """The view if nobody looked at things with these rims (D, 2), base frame [m].

        It ends so far before them that nothing as wide as they are can be missed there.
        """
        ranges, step = self.ranges.copy(), float(np.diff(self.bearings).max(initial=0.0))
        for one, other in zip(left, right, strict=True):
            first, last = sorted((math.atan2(one[1], one[0]), math.atan2(other[1], other[0])))
            there = (self.bearings >= first - step) & (self.bearings <= last + step)
            near = min(math.hypot(*one), math.hypot(*other)) - math.dist(one, other) - _berth
            ranges[there] = np.minimum(ranges[there], max(near, 0.0))
        return GroundView(self.bearings, ranges, self.near)


@dataclass(frozen=True)
class _Cells:
    """Which polar cell of the ground each pixel looks at."""

    pixels: Ints
    """(P,) flat indices of the pixels that look at a cell."""
    directions: Floats
    """(P, 3) of these pixels, as in `CameraRays`."""
    cell: Ints
    """(P,) their cells, bearing first."""
    count: Floats
    """(V, R) pixels of each cell."""
    bearings: Floats
    near: float

    def sums(self, values: NDArray[Any]) -> Floats:
        """Sum (V, R) of values (P,) in each cell."""
        total = np.bincount(self.cell, values, minlength=self.count.size)
        return total.astype(np.float64).reshape(self.count.shape)


def ground_view(
    depth: Floats, intrinsics: Intrinsics, base_from_camera: Pose3, range_max: float
) -> GroundView:
    """View of a depth image (H, W) [m]; ranges are at most `range_max` [m]."""
    cells = _ground_cells(intrinsics, base_from_camera, range_max)
    reading = depth.reshape(-1)[cells.pixels]
    points = np.array(base_from_camera.position) + cells.directions * reading[:, None]
    measured = reading > 0
    distance = np.hypot(points[:, 0], points[:, 1])
    hiding = measured & (points[:, 2] > _height_tolerance + _slope_tolerance * distance)
    hiding_count, measured_count = cells.sums(hiding), cells.sums(measured)
    hidden = hiding_count > _hidden_share * measured_count
    ends = (hidden | (measured_count < _measured_share * cells.count)) & (cells.count > 0)
    # What hides a cell stands before it: the view ends there already.
    obstacle = cells.sums(hiding * distance) / np.maximum(hiding_count, 1)
    starts = np.arange(cells.count.shape[1]) * _range_step
    limits = np.where(hidden, np.minimum(obstacle, starts), starts)
    ranges = np.where(ends.any(axis=1), _at(limits, ends.argmax(axis=1)), range_max)
    return GroundView(cells.bearings, ranges, cells.near)


def _at(rows: Floats, index: NDArray[np.intp]) -> Floats:
    """One element (V,) of each row of (V, R)."""
    return np.take_along_axis(rows, index[:, None], axis=1)[:, 0]


@lru_cache(maxsize=8)
def _ground_cells(intrinsics: Intrinsics, base_from_camera: Pose3, range_max: float) -> _Cells:
    rays = camera_rays(intrinsics, base_from_camera)
    x, y = rays.ground.reshape(-1, 2).T
    distance, bearing = np.hypot(x, y), np.arctan2(y, x)
    looked = np.flatnonzero(distance < range_max)
    edges = np.linspace(bearing[looked].min(), bearing[looked].max(), bearings_count + 1)
    column = np.clip(np.searchsorted(edges, bearing[looked], "right") - 1, 0, bearings_count - 1)
    steps = int(np.ceil(range_max / _range_step))
    cell = column * steps + (distance[looked] / _range_step).astype(int)
    count = np.bincount(cell, minlength=bearings_count * steps).astype(float)
    return _Cells(
        pixels=looked.astype(np.int32),
        directions=rays.directions.reshape(-1, 3)[looked],
        cell=cell.astype(np.int32),
        count=count.reshape(bearings_count, steps),
        bearings=(edges[:-1] + edges[1:]) / 2,
        near=float(distance[looked].min()),
    )
