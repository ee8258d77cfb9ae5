"""Whether the camera sees what it saw: a cheap look at a small picture.

Colours are compared as means of small blocks, in which noise averages out and an object that comes,
goes or moves does not; depths at one pixel of each, where both pictures have one.
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
"""Readings that changed by more, as a share of them, are of other things."""
_few = 2
"""Readings that may flicker: at edges one is of this side or of that."""
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
    """(h, w) samples [m]; 0 where nothing was measured."""
    range_max: float
    """Depth beyond it is not told apart [m]."""
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
        nearer = np.minimum(self.depth, other.depth)
        compared = (nearer > 0) & (nearer < self.range_max)
        apart = np.abs(self.depth - other.depth) > _depth_step * (0.5 + nearer)
        return int(np.count_nonzero(compared & apart)) <= _few


def view_in(frame: RgbdFrame, range_max: float) -> View:
    """The small picture of a frame; depth beyond `range_max` [m] is not told apart."""
    size = max(frame.intrinsics.width // _block, 1), max(frame.intrinsics.height // _block, 1)
    means = cv2.resize(frame.color, size, interpolation=cv2.INTER_AREA)
    samples = frame.depth_mm[_block // 2 :: _block, _block // 2 :: _block]
    return View(
        colour=np.asarray(means, np.float32),
        depth=samples.astype(np.float32) / np.float32(1000.0),
        range_max=range_max,
        odom_from_base=frame.odom_from_base,
        base_from_camera=frame.base_from_camera,
    )
