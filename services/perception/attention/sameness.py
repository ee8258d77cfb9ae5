"""Whether the camera sees what it saw: a cheap look at a small picture.

Colours and depths are compared as means of small blocks, in which noise averages out and an object
that comes, goes or moves does not.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from schemas.arrays import Floats32
from schemas.geometry import Pose2, Pose3
from schemas.sensing import RgbdFrame

_block = 4
"""Side of the blocks [px]."""
_colour_step = 10.0
"""Noise changes the mean colour of a block by less than this, of 255."""
_depth_step = 0.15
"""Blocks whose mean depth, trusted as far as the camera is, changed by more, as a share of it."""
_few = 2
"""Blocks of a depth image that may flicker: at edges one reading is of this side or of that."""
_moved = 0.003
"""Dead reckoning of a base that stands still changes by less than this [m]."""
_turned = 0.002
"""[rad]"""


@dataclass(frozen=True)
class View:
    """A small picture, and from where it was taken."""

    colour: Floats32
    """(h, w, 3) means of blocks."""
    depth: Floats32
    """(h, w) means of blocks [m]; what lies beyond the trusted range counts as there."""
    odom_from_base: Pose2
    base_from_camera: Pose3

    def shows_same(self, other: "View") -> bool:
        """Whether nothing has changed but noise."""
        return (
            self.colour.shape == other.colour.shape
            and self.base_from_camera == other.base_from_camera
            and self._stands_with(other)
            and bool(cv2.absdiff(self.colour, other.colour).max() < _colour_step)
            and self._as_deep(other)
        )

    def _stands_with(self, other: "View") -> bool:
        step = self.odom_from_base.inverse() @ other.odom_from_base
        return abs(step.x) < _moved and abs(step.y) < _moved and abs(step.yaw) < _turned

    def _as_deep(self, other: "View") -> bool:
        apart = np.abs(self.depth - other.depth)
        return int(np.count_nonzero(apart > _depth_step * (0.5 + self.depth))) <= _few


def view_in(frame: RgbdFrame, range_max: float) -> View:
    """The small picture of a frame; depth beyond `range_max` [m] is not told apart."""
    size = max(frame.intrinsics.width // _block, 1), max(frame.intrinsics.height // _block, 1)
    near = np.minimum(frame.depth_mm - np.uint16(1), np.uint16(min(1000 * range_max, 65535)))
    return View(
        colour=_means(frame.color, size).astype(np.float32),
        depth=_means(near, size).astype(np.float32) / np.float32(1000.0),
        odom_from_base=frame.odom_from_base,
        base_from_camera=frame.base_from_camera,
    )


def _means(picture: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA))
