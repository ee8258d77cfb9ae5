"""The visible side of an object: which points of the depth image are on it, and their measures.

A camera sees the front of an object through a rectangle that also shows what is before it, behind
it and under it. So: take the depths inside the box, leave out what it stands on, group the rest
into layers, and keep the layer that the middle of the box lies on.
"""

import math
from dataclasses import dataclass

import numpy as np

from schemas.arrays import Flags, Floats
from schemas.sensing import Intrinsics
from services.perception.space.rays import CameraRays
from services.perception.space.support import support_height

MEASURES = (
    "one",
    "width",
    "mean_width",
    "spread",
    "rim",
    "low",
    "high",
    "box_height",
    "fill",
    "cut_x",
    "cut_x_width",
    "cut_top",
    "cut_bottom",
    "cut_y_height",
    "side",
    "side_width",
    "skew",
)
"""What a surface is described by, in metres unless said otherwise:

    one           1
    width         of the box at the surface's depth
    mean_width    of the rows that show the object
    spread        of the points across the view, 2 to 98 %
    rim           how far the middle of the surface lies behind its nearest part
    low, high     of the points above what the object stands on, 2 and 98 %
    box_height    of the box at the surface's depth
    fill          share of the box that the surface fills, in [0, 1]
    cut_x         1 where the picture's left or right edge cuts the object, else 0
    cut_x_width   the same times width
    cut_top       1 where the upper edge cuts it, cut_bottom where the lower one does
    cut_y_height  either of them times box_height
    side          +1 where the right edge cuts it, -1 where the left one does, else 0
    side_width    the same times width
    skew          how far the median lies from the middle of `spread`, to the left

The last three change sign in a mirror, the others do not.
"""
MIRRORED: Flags = np.array([name in ("side", "side_width", "skew") for name in MEASURES])

_layer_step = 0.12
"""Surfaces closer together than this along the optical axis are one [m]."""
_least_pixels = 12
_least_share = 0.3
"""Of the box's inner part that must be on the object."""
_inner = 0.7
"""Diameter of the inner part of a box, which the object itself fills best, in sides."""
_spread = 0.2
"""Standard deviation of the weight around the middle of a box, in sides."""
ABOVE_SUPPORT = (0.012, 0.012)
"""Points lower than this above the support belong to it: always [m], and for each metre of range,
because readings scatter and the base pitches a little [m/m]."""


@dataclass(frozen=True)
class Surface:
    """Visible side of one object."""

    points: Floats
    """(P, 3) base frame [m]."""
    depth: float
    """Median, along the optical axis [m]."""
    toward: Floats
    """(2,) Unit vector from the camera to the middle of the box, horizontal."""
    anchor: Floats
    """(3,) Base frame [m]: nearest part of the surface, middle across the view, on the support."""
    measures: Floats
    """(len(MEASURES),)"""

    @property
    def axes(self) -> Floats:
        """(3, 3) Columns along, across (to the left) and up, of the view, in the base frame."""
        x, y = self.toward
        return np.array([[x, -y, 0.0], [y, x, 0.0], [0.0, 0.0, 1.0]])


def surface_in(
    box: Floats,
    depth: Floats,
    rays: CameraRays,
    intrinsics: Intrinsics,
    range_max: float,
    pixels: int | None = None,
) -> Surface | None:
    """The surface in a box (4,) x0 y0 x1 y1 [px] of a depth image (H, W) [m].

    None where there is nothing to speak of, or it lies beyond `range_max` [m]. Of a box of many
    more than so many pixels only every second, third ... in each direction is read.
    """
    rows, columns, step = _window(box, depth.shape, pixels)
    inside = depth[rows, columns]
    points = rays.origin + rays.directions[rows, columns] * inside[..., None]
    support = support_height(box, depth, rays, step)
    distance = np.hypot(points[..., 0] - rays.origin[0], points[..., 1] - rays.origin[1])
    lowest = support + ABOVE_SUPPORT[0] + ABOVE_SUPPORT[1] * distance
    solid = (inside > 0) & (points[..., 2] > lowest)
    layer = _object_layer(inside, solid, range_max, step)
    if layer is None:
        return None
    return _measured(box, layer, inside, points, support, rays, intrinsics, step)


def _measured(
    box: Floats,
    layer: Flags,
    depth: Floats,
    points: Floats,
    support: float,
    rays: CameraRays,
    intrinsics: Intrinsics,
    step: int,
) -> Surface:
    toward, own = _horizontal_direction(box, rays), points[layer]
    offset = own[:, :2] - rays.origin[:2]
    along, across = offset @ toward, offset @ np.array([-toward[1], toward[0]])
    near, left, right = np.percentile(along, 5), *np.percentile(across, [2, 98])
    low, high = np.percentile(own[:, 2] - support, [2, 98])
    middle = float(np.median(depth[layer]))
    per_pixel = middle / intrinsics.fx
    width, height = (box[2] - box[0]) * per_pixel, (box[3] - box[1]) * per_pixel
    cut_left, cut_top = box[0] <= 1, box[1] <= 1
    cut_right, cut_bottom = box[2] >= intrinsics.width - 1, box[3] >= intrinsics.height - 1
    side = float(cut_right) - float(cut_left)
    cut_x, cut_y = float(cut_left or cut_right), float(cut_top or cut_bottom)
    rows = max(int(np.count_nonzero(layer.any(axis=1))), 1)
    measures = np.array([
        1.0, width, step * np.count_nonzero(layer) / rows * per_pixel, right - left,
        np.median(along) - near, low, high, height, layer.mean(), cut_x, cut_x * width,
        float(cut_top), float(cut_bottom), cut_y * height, side, side * width,
        np.median(across) - (left + right) / 2,
    ])  # fmt: skip
    axes = np.array([toward, [-toward[1], toward[0]]]).T
    ahead = rays.origin[:2] + axes @ np.array([near, (left + right) / 2])
    return Surface(own, middle, toward, np.array([*ahead, support]), measures)


def _horizontal_direction(box: Floats, rays: CameraRays) -> Floats:
    """Unit vector (2,) in the base frame from the camera to the middle of a box."""
    height, width = rays.directions.shape[:2]
    row = int(np.clip((box[1] + box[3]) / 2, 0, height - 1))
    column = int(np.clip((box[0] + box[2]) / 2, 0, width - 1))
    toward = rays.directions[row, column, :2]
    return toward / np.linalg.norm(toward)


def _window(box: Floats, shape: tuple[int, ...], pixels: int | None) -> tuple[slice, slice, int]:
    """Rows and columns of a box, at least one of each, and of how many one is read."""
    height, width = shape
    x0, y0 = min(int(box[0]), width - 1), min(int(box[1]), height - 1)
    x1, y1 = max(round(float(box[2])), x0 + 1), max(round(float(box[3])), y0 + 1)
    step = max(1, math.isqrt((y1 - y0) * (x1 - x0) // pixels)) if pixels else 1
    return slice(y0, y1, step), slice(x0, x1, step), step


def _object_layer(depth: Floats, solid: Flags, range_max: float, step: int) -> Flags | None:
    """Pixels (h, w) of the surface that the middle of the window lies on."""
    weight = _centre_weight(depth.shape)
    least = _least_pixels / step**2
    if np.count_nonzero(solid) < least:
        return None
    bins = (depth / _layer_step).astype(int)
    mass = np.bincount(bins[solid], weight[solid]).astype(np.float64)
    first, last = _heaviest_run(mass, least=0.05 * mass.max())
    # The rim of a round object is steep: few pixels in the next bin, but they are its own.
    layer = solid & (bins >= first - 1) & (bins <= last + 1)
    inner = weight >= np.exp(-0.5 * (_inner / 2 / _spread) ** 2)
    enough = np.count_nonzero(layer & inner) >= _least_share * np.count_nonzero(inner)
    if not enough or np.count_nonzero(layer) < least:
        return None
    return layer if np.median(depth[layer]) <= range_max else None


def _centre_weight(shape: tuple[int, ...]) -> Floats:
    y, x = (((np.arange(n) + 0.5) / n - 0.5) / _spread for n in shape)
    return np.exp(-0.5 * (y[:, None] ** 2 + x[None] ** 2))


def _heaviest_run(mass: Floats, least: float) -> tuple[int, int]:
    """First and last bin of the run of occupied bins that weighs most."""
    occupied = np.concatenate([[False], mass > least, [False]])
    edges = np.flatnonzero(np.diff(occupied.astype(int)))
    starts, ends = edges[::2], edges[1::2]
    total = np.concatenate([[0.0], np.cumsum(mass)])
    best = int(np.argmax(total[ends] - total[starts]))
    return int(starts[best]), int(ends[best]) - 1
