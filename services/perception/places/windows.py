"""How a picture becomes what the classifier of places looks at, in training and on a robot.

A picture is cut into windows of 4:3 side by side, one for a usual camera and three for one that
sees 120 degrees; each is made small. With depth, every window has a point ahead: the ground before
what most of its middle shows.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Floats
from services.perception.space.rays import CameraRays

window_width, window_height = 160, 120
"""Of the small pictures [px]."""
input_height = 128
"""Of the network's input [px]: a multiple of 16, grey below the picture."""
_aspect = 4 / 3
_padding_value = 114
_least_measured = 0.05
"""Share of a window's middle whose depth must be known."""
_solid_heights = (0.1, 2.3)
"""Floor and ceiling do not count as what a window shows [m]."""
_before = 0.8
"""The point ahead is at this share of the distance to what stands there."""


def windows_of(width: int, height: int) -> list[slice]:
    """Columns of the windows of a picture, from left to right."""
    wide = min(width, round(_aspect * height))
    count = max(1, math.ceil(width / wide - 0.1))
    starts = np.linspace(0, width - wide, count) if count > 1 else [(width - wide) / 2]
    return [slice(round(float(start)), round(float(start)) + wide) for start in starts]


def window_pictures(color: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Windows (K, 120, 160, 3) of a picture (H, W, 3), RGB."""
    height, width = color.shape[:2]
    size = (window_width, window_height)
    return np.array(
        [
            cv2.resize(color[:, columns], size, interpolation=cv2.INTER_AREA)
            for columns in windows_of(width, height)
        ],
        np.uint8,
    )


def network_input(window: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Blob (1, 3, 128, 160), RGB in [0, 1], of one window (120, 160, 3)."""
    padded = np.full((input_height, window_width, 3), _padding_value, np.uint8)
    padded[:window_height] = window
    return np.asarray(cv2.dnn.blobFromImage(padded, scalefactor=1 / 255), np.float32)


def points_ahead(depth: Floats, rays: CameraRays) -> Floats:
    """Points (K, 2) in the base frame [m] that the windows speak of; not a number without depth."""
    height, width = depth.shape
    return np.array(
        [_point(depth, rays, _middle(columns)) for columns in windows_of(width, height)]
    )


def _middle(columns: slice) -> slice:
    quarter = (columns.stop - columns.start) // 4
    return slice(columns.start + quarter, columns.stop - quarter)


def _point(depth: Floats, rays: CameraRays, columns: slice) -> Floats:
    seen, directions = depth[:, columns], rays.directions[:, columns]
    heights = rays.origin[2] + directions[..., 2] * seen
    low, high = _solid_heights
    solid = (seen > 0) & (heights > low) & (heights < high)
    if np.count_nonzero(solid) < _least_measured * solid.size:
        return np.full(2, np.nan)
    level = directions[..., :2]
    distance = float(np.median(seen[solid] * np.hypot(level[solid, 0], level[solid, 1])))
    toward = level[level.shape[0] // 2, level.shape[1] // 2]
    return rays.origin[:2] + _before * distance * toward / np.hypot(*toward)
