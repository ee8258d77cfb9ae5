"""Where in a picture anything can be: the parts in which something stands out of the ground.

An object that has no depth within the trusted range cannot be placed, and what is placed sticks out
of what it stands on. So sky, ground and everything beyond are not worth a network's time, and
leaving them out loses nothing: what the depth image shows bare is bare.
"""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from schemas.arrays import Flags, Floats, Ints, Words
from schemas.geometry import Pose3
from schemas.sensing import Intrinsics, RgbdFrame
from services.perception.space.rays import camera_rays
from services.perception.space.surface import ABOVE_SUPPORT

_block = 4
"""Side of the blocks in which standing out is looked for [px]."""
_least_pixels = 8
"""Fewer are no object: `services.perception.space.surface` asks for more."""
_farther, _near = 1.5, 1.1
"""Objects whose middle is in range reach farther, and have a part that does not, in ranges."""
_margin = 24
"""A network judges an object by what is around it, too [px]."""


@dataclass(frozen=True)
class Shapes:
    """R things that stand out of the ground, each by what hangs together in the picture."""

    boxes_px: Ints
    """(R, 4) x0 y0 x1 y1 around them."""
    picture_size: tuple[int, int]
    """Width and height [px]."""
    left: Floats
    """(R, 2) Their left rims at their mean depth, base frame [m]."""
    right: Floats
    """(R, 2) Their right rims."""
    top: Floats
    """(R,) Height of their upper rims [m]."""

    @property
    def regions_px(self) -> Ints:
        """(R, 4) Boxes with a margin, within the picture."""
        width, height = self.picture_size
        low = np.maximum(self.boxes_px[:, :2] - _margin, 0)
        high = np.minimum(self.boxes_px[:, 2:] + _margin, [width, height])
        return np.concatenate([low, high], axis=1).astype(np.int32)

    @property
    def distance(self) -> Floats:
        """(R,) To the nearer rim [m]."""
        return np.minimum(np.hypot(*self.left.T), np.hypot(*self.right.T))

    def selected(self, rows: Flags) -> "Shapes":
        """Some of them."""
        columns = (self.left[rows], self.right[rows], self.top[rows])
        return Shapes(self.boxes_px[rows], self.picture_size, *columns)


def shapes_in(frame: RgbdFrame, range_max: float) -> Shapes | None:
    """What stands out of the ground within about `range_max` [m].

    None where no depth was measured at all: then anything can be anywhere.
    """
    if not frame.depth_mm.any():
        return None
    limits = _ground_limits(frame.intrinsics, frame.base_from_camera, range_max)
    # Of 0, which is no depth, one less is more than any limit.
    standing = frame.depth_mm - np.uint16(1) < limits
    near = standing & (frame.depth_mm < 1000 * _near * range_max)
    boxes, depth = _blobs(standing, near, frame.depth_mm)
    size = frame.intrinsics.width, frame.intrinsics.height
    return Shapes(boxes, size, *_rims(boxes, depth, frame))


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


def _blobs(standing: Flags, near: Flags, depth_mm: Words) -> tuple[Ints, Floats]:
    """Boxes (R, 4) [px] around what hangs together in a mask (H, W), and mean depths (R,) [m].

    What has nothing in a second mask `near` (H, W), a part of the first, is left out.
    """
    height, width = standing.shape
    columns, rows = max(width // _block, 1), max(height // _block, 1)
    share = _means(standing.astype(np.float32), columns, rows)
    close = _means(near.astype(np.float32), columns, rows)
    deep = _means(np.where(near, depth_mm, 0).astype(np.float32), columns, rows)
    count, labels, stats, _ = cv2.connectedComponentsWithStats((share > 0).astype(np.uint8))
    within = [np.bincount(labels.ravel(), of.ravel(), count)[1:] for of in (close, deep)]
    pixels = within[0] * (width * height) / (columns * rows)
    scale = np.array([width / columns, height / rows])
    low, high = stats[1:, :2] * scale, (stats[1:, :2] + stats[1:, 2:4]) * scale
    boxes = np.concatenate([np.floor(low), np.ceil(high)], axis=1).astype(np.int32)
    kept = pixels >= _least_pixels
    return boxes[kept], within[1][kept] / within[0][kept] / 1000.0


def _rims(boxes: Ints, depth: Floats, frame: RgbdFrame) -> tuple[Floats, Floats, Floats]:
    """Left and right rims (R, 2) and heights (R,) in the base frame, of boxes (R, 4) at depths."""
    rays = camera_rays(frame.intrinsics, frame.base_from_camera)
    x0, y0, x1, y1 = (boxes - [0, 0, 1, 1]).T
    middle = (y0 + y1) // 2
    left, right, top = (
        rays.origin + rays.directions[y, x] * depth[:, None]
        for y, x in ((middle, x0), (middle, x1), (y0, x0))
    )
    return left[:, :2], right[:, :2], top[:, 2]


def _means(picture: np.ndarray, width: int, height: int) -> np.ndarray:
    return np.asarray(cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA))
