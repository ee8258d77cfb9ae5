"""Where in a picture anything can be: the parts in which something stands out of the ground.

An object that has no depth within the trusted range cannot be placed, and what is placed sticks out
of what it stands on. So sky, ground and everything beyond are not worth a network's time, and
leaving them out loses nothing: what the depth image shows bare is bare.
"""

from functools import lru_cache

import cv2
import numpy as np

from schemas.arrays import Bytes, Ints, Words
from schemas.geometry import Pose3
from schemas.sensing import Intrinsics, RgbdFrame
from services.perception.space.rays import camera_rays
from services.perception.space.surface import ABOVE_SUPPORT

_block = 4
"""Side of the blocks in which standing out is looked for [px]."""
_least_pixels = 8
"""Fewer are no object: `services.perception.space.surface` asks for more."""
_farther = 1.25
"""Objects whose middle is in range reach farther, in ranges."""
_margin = 24
"""A network judges an object by what is around it, too [px]."""


def regions_in(frame: RgbdFrame, range_max: float) -> Ints | None:
    """Parts (R, 4) x0 y0 x1 y1 [px] of a picture in which objects can be; R may be zero.

    None where no depth was measured at all: then they can be anywhere.
    """
    if not frame.depth_mm.any():
        return None
    limits = _ground_limits(frame.intrinsics, frame.base_from_camera, range_max)
    # Of 0, which is no depth, one less is more than any limit.
    standing = (frame.depth_mm - np.uint16(1) < limits).view(np.uint8) * np.uint8(255)
    return _blobs(standing)


@lru_cache(maxsize=8)
def _ground_limits(intrinsics: Intrinsics, base_from_camera: Pose3, range_max: float) -> Words:
    """(H, W) Depths [mm] at which each pixel may show the ground, or at which trust ends."""
    rays = camera_rays(intrinsics, base_from_camera)
    level = np.hypot(rays.directions[..., 0], rays.directions[..., 1])
    always, for_each_metre = ABOVE_SUPPORT
    falling = for_each_metre * level - rays.directions[..., 2]
    height = max(float(rays.origin[2]) - always, 0.0)
    depth = np.divide(height, falling, out=np.full_like(falling, np.inf), where=falling > 0)
    return np.floor(1000 * np.minimum(depth, _farther * range_max)).clip(0, 65535).astype(np.uint16)


def _blobs(standing: Bytes) -> Ints:
    """Boxes (R, 4) [px] around what hangs together in a mask (H, W) of 0 and 255, with margins."""
    height, width = standing.shape
    size = max(width // _block, 1), max(height // _block, 1)
    small = np.asarray(cv2.resize(standing, size, interpolation=cv2.INTER_AREA))
    _, labels, stats, _ = cv2.connectedComponentsWithStats((small > 0).astype(np.uint8))
    share = np.bincount(labels.ravel(), small.ravel(), minlength=len(stats))
    pixels = share / 255.0 * (width * height) / (size[0] * size[1])
    scale = np.array([width / size[0], height / size[1]])
    low = np.floor(stats[:, :2] * scale - _margin)
    high = np.ceil((stats[:, :2] + stats[:, 2:4]) * scale + _margin)
    boxes = np.concatenate([np.maximum(low, 0), np.minimum(high, [width, height])], axis=1)
    # The first is what is left over.
    return boxes[1:][pixels[1:] >= _least_pixels].astype(np.int32)
