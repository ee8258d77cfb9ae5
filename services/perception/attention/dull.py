"""What was looked at a moment ago and showed nothing that is wanted: it can wait.

A thing is known again by where its rims are. One that another thing comes out behind, that is seen
from another side, or that has come much nearer is another thing, and is looked at.
"""

from dataclasses import dataclass, replace

import numpy as np

from schemas.arrays import Flags, Floats
from schemas.geometry import Pose2
from services.perception.attention.regions import Shapes

_shift = (0.1, 0.02)
"""Rims of the same thing differ by less than this: always [m], and for each metre of range."""
_nearer = 0.75
"""From this share of the distance a network may see what it did not see before."""


@dataclass(frozen=True)
class Dull:
    """D things, where they were when they were looked at."""

    left: Floats
    """(D, 2) Rims, odometry frame [m]."""
    right: Floats
    """(D, 2)"""
    top: Floats
    """(D,) [m]"""
    distance: Floats
    """(D,) From which each was looked at [m]."""

    def known(self, shapes: Shapes, odom_from_base: Pose2) -> Flags:
        """(R,) Which of the things that are seen now are among them."""
        now = _placed(shapes, odom_from_base)
        allowed = _shift[0] + _shift[1] * now.distance[:, None]
        same: Flags = (
            (_apart(now.left, self.left) < allowed)
            & (_apart(now.right, self.right) < allowed)
            & (np.abs(now.top[:, None] - self.top) < allowed)
            & (now.distance[:, None] > _nearer * self.distance)
        )
        return np.asarray(same.any(axis=1), np.bool_)

    def with_these(self, shapes: Shapes, odom_from_base: Pose2) -> "Dull":
        """These and more."""
        more = _placed(shapes, odom_from_base)
        names = ("left", "right", "top", "distance")
        joined = {n: np.concatenate([getattr(self, n), getattr(more, n)]) for n in names}
        return replace(self, **joined)


NOTHING_DULL = Dull(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0))


def _placed(shapes: Shapes, odom_from_base: Pose2) -> Dull:
    left, right = odom_from_base.apply(shapes.left), odom_from_base.apply(shapes.right)
    return Dull(left, right, shapes.top, shapes.distance)


def _apart(one: Floats, other: Floats) -> Floats:
    """Distances (R, D) between points (R, 2) and (D, 2)."""
    return np.linalg.norm(one[:, None] - other, axis=2)
