"""From a box in the picture to an upright box in space, with its uncertainty.

The camera sees the front of an object through a rectangle that also shows what is in front of it
and behind it. So: take the depths inside the box, leave out the ground, group them into layers,
keep the layer that the middle of the box lies on, and put the object's centre behind that surface.
"""

from dataclasses import dataclass

import numpy as np

from schemas.arrays import Flags, Floats
from schemas.sensing import Intrinsics
from services.perception.rays import CameraRays, axial_noise

ground_height = 0.06
"""Points lower than this belong to the ground [m]."""
_layer_step = 0.12
"""Surfaces closer together than this along the optical axis are one [m]."""
_least_pixels = 12
_least_share = 0.3
"""Of the box's inner part that must be on the object."""
_inner = 0.7
"""Diameter of the inner part of a box, which the object itself fills best, in sides."""
_spread = 0.2
"""Standard deviation of the weight around the middle of a box, in sides."""
_deepest_unseen = 3.5
"""An object is taken to be as deep as it is wide on average over its height, up to this [m].

The average, since a cone's foot is no measure of its body; the limit, for the front of a house.
"""
_surface_offset = 0.4
"""Centre behind the median of the visible surface, in depths, of a round object."""
_box_noise_px = 1.5
_shape_noise = 0.12
"""Of the object's depth that the guess at its unseen half may be wrong."""
_edge_noise = 0.08
"""Of an extent, since detected boxes do not fit to the pixel."""
_large_noise = 0.25
"""Of the size beyond one metre: how a car or a house is turned, and where it ends, is not seen."""
_cut_noise = 0.35
"""Of an extent that continues beyond the picture's edge."""


@dataclass(frozen=True)
class LocatedObject:
    """An object in the base frame."""

    center: Floats
    """(3,) [m]"""
    covariance: Floats
    """(3, 3) of the centre [m^2]."""
    extents: Floats
    """(3,) sizes of the upright box around it, along the base's axes [m]."""


@dataclass(frozen=True)
class _Surface:
    """The visible side of an object."""

    depth: float
    """Median, along the optical axis [m]."""
    mean_width_px: float
    along: Floats
    """Horizontal distances of its points from the camera, in the viewing direction [m]."""
    height: float
    """[m]"""


@dataclass(frozen=True)
class _Span:
    """Sizes of an object as the camera sees it, and how well they are known [m]."""

    width: float
    depth: float
    height: float
    along_deviation: float
    across_deviation: float
    up_deviation: float


def locate(
    box: Floats, depth: Floats, rays: CameraRays, intrinsics: Intrinsics, range_max: float
) -> LocatedObject | None:
    """Place the object in a box (4,) x0 y0 x1 y1 [px], given a depth image (H, W) [m].

    Returns None where the object has no depth to speak of, or lies beyond `range_max` [m]: a
    detection without a place says nothing to a map.
    """
    rows, columns = _window(box, depth.shape)
    depth = depth[rows, columns]
    points = rays.origin + rays.directions[rows, columns] * depth[..., None]
    solid = (depth > 0) & (points[..., 2] > ground_height)
    layer = _object_layer(depth, solid, range_max)
    if layer is None:
        return None
    toward = _horizontal_direction(box, rays)
    along = (points[layer][:, :2] - rays.origin[:2]) @ toward
    low, high = _heights(points[layer][:, 2])
    surface = _Surface(float(np.median(depth[layer])), _mean_width(layer), along, high - low)
    span = _span(box, surface, intrinsics)
    middle = rays.origin[:2] + toward * (np.median(along) + _surface_offset * span.depth)
    center = np.array([*middle, (low + high) / 2])
    return LocatedObject(center, _covariance(span, toward), _extents(span, toward))


def _horizontal_direction(box: Floats, rays: CameraRays) -> Floats:
    """Unit vector (2,) in the base frame from the camera to the middle of a box."""
    height, width = rays.directions.shape[:2]
    row = int(np.clip((box[1] + box[3]) / 2, 0, height - 1))
    column = int(np.clip((box[0] + box[2]) / 2, 0, width - 1))
    toward = rays.directions[row, column, :2]
    return toward / np.linalg.norm(toward)


def _window(box: Floats, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Rows and columns of a box, at least one of each."""
    height, width = shape
    x0, y0 = min(int(box[0]), width - 1), min(int(box[1]), height - 1)
    x1, y1 = max(round(float(box[2])), x0 + 1), max(round(float(box[3])), y0 + 1)
    return slice(y0, y1), slice(x0, x1)


def _object_layer(depth: Floats, solid: Flags, range_max: float) -> Flags | None:
    """Pixels (h, w) of the surface that the middle of the window lies on."""
    weight = _centre_weight(depth.shape)
    if np.count_nonzero(solid) < _least_pixels:
        return None
    bins = (depth / _layer_step).astype(int)
    mass = np.bincount(bins[solid], weight[solid]).astype(np.float64)
    first, last = _heaviest_run(mass, least=0.05 * mass.max())
    # The rim of a round object is steep: few pixels in the next bin, but they are its own.
    layer = solid & (bins >= first - 1) & (bins <= last + 1)
    inner = weight >= np.exp(-0.5 * (_inner / 2 / _spread) ** 2)
    enough = np.count_nonzero(layer & inner) >= _least_share * np.count_nonzero(inner)
    if not enough or np.count_nonzero(layer) < _least_pixels:
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


def _heights(heights: Floats) -> tuple[float, float]:
    """Lower and upper end of an object that stands on the ground if it comes near it."""
    low, high = np.percentile(heights, [2, 98]).tolist()
    return (0.0 if low < 4 * ground_height else low), high


def _mean_width(layer: Flags) -> float:
    """Pixels in a row, on average over the rows that show the object."""
    return float(np.count_nonzero(layer) / np.count_nonzero(layer.any(axis=1)))


def _span(box: Floats, surface: _Surface, intrinsics: Intrinsics) -> _Span:
    """Sizes and their deviations."""
    metres_per_pixel = surface.depth / intrinsics.fx
    width = float(box[2] - box[0]) * metres_per_pixel
    near, far = np.percentile(surface.along, [5, 95]).tolist()
    round_depth = min(surface.mean_width_px * metres_per_pixel, _deepest_unseen)
    depth, pixel = max(round_depth, far - near), _box_noise_px * metres_per_pixel
    cut_x, cut_y = _cut(box[::2], intrinsics.width), _cut(box[1::2], intrinsics.height)
    unseen = _large_noise * max(0.0, max(width, surface.height) - 1.0)
    unseen += _cut_noise * width if cut_x else 0.0
    up = (_cut_noise if cut_y else _edge_noise) * surface.height
    return _Span(
        width=width,
        depth=depth,
        height=surface.height,
        along_deviation=float(np.hypot(axial_noise(surface.depth), unseen + _shape_noise * depth)),
        across_deviation=float(np.hypot(pixel, unseen + _edge_noise * width)),
        up_deviation=float(np.hypot(pixel, up)),
    )


def _cut(ends: Floats, size: int) -> bool:
    return bool(ends[0] <= 1 or ends[1] >= size - 1)


def _covariance(span: _Span, toward: Floats) -> Floats:
    """Covariance in the base frame; `toward` (2,) is the horizontal viewing direction."""
    axes = np.array([[toward[0], -toward[1], 0], [toward[1], toward[0], 0], [0, 0, 1]])
    deviations = np.array([span.along_deviation, span.across_deviation, span.up_deviation])
    return axes @ np.diag(deviations**2) @ axes.T


def _extents(span: _Span, toward: Floats) -> Floats:
    """Box around an upright ellipse that is `depth` deep and `width` wide."""
    x = np.hypot(toward[0] * span.depth, toward[1] * span.width)
    y = np.hypot(toward[1] * span.depth, toward[0] * span.width)
    return np.array([x, y, span.height])
