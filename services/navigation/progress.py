"""Notices that the base wants to move and does not."""

import numpy as np

from schemas.geometry import Pose2, wrap_angle

patience_s = 3.0
"""Time without progress after which the base counts as stuck [s]."""
_moved = 0.1
_turned = 0.15


class ProgressWatch:
    """Time since the base last changed its place or heading."""

    def __init__(self) -> None:
        self._anchor: Pose2 | None = None
        self._since_ns = 0

    def restart(self) -> None:
        """Begin to wait anew."""
        self._anchor = None

    def is_stuck(self, pose: Pose2, stamp_ns: int) -> bool:
        """Whether `pose` (of any one frame) has been about the same for `patience_s`."""
        if self._anchor is None or _differs(self._anchor, pose):
            self._anchor, self._since_ns = pose, stamp_ns
        return stamp_ns - self._since_ns > patience_s * 1e9


def _differs(a: Pose2, b: Pose2) -> bool:
    far = float(np.hypot(a.x - b.x, a.y - b.y)) > _moved
    return far or abs(wrap_angle(a.yaw - b.yaw)) > _turned
