"""What stands around the robot, remembered in the frame of dead reckoning.

The camera on the mast does not see what the arm can reach: when the robot stands before a box, it
has left the picture. So what was seen on the way there is kept, and bettered by the wrist's camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robots.arm_kinematics import inverse_of, matrix
from schemas.arrays import Floats
from schemas.geometry import Pose2
from schemas.perception import SOLID_KINDS, Bodies
from services.manipulation.obstacles import Obstacle, body_frame

_near = 3.0
"""Farther from the base than this nothing is in the arm's way [m]."""
_drift = 1e-4
"""By which a place that was seen earlier grows uncertain [m^2/s]."""
_much_worse = 4.0
"""An estimate whose variance is greater than another's by this factor adds nothing to it."""
_alike_pictures = 6
"""Errors of pictures are alike: more of them than so many say no more."""
_most_looks = 6
_same_side = 0.95
"""Cosine of the angle between two boxes below which they are not turned alike."""
_most_apart = 0.5
"""Two estimates of one place are never farther apart [m]."""
_alike = 1.5
"""Ratio of two lengths up to which one thing may have been taken for two classes."""

_smaller = 0.6
"""Share of the room of a box beyond which nothing is in it: it may be the box itself."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A simple shape that a body consists of."""

    kind: str
    """One of `SOLID_KINDS`."""
    box_from_solid: Floats
    """(4, 4)"""
    size: Floats
    """(3,) [m], as in `Bodies`."""


@dataclass(frozen=True, eq=False)
class Body:
    """One thing."""

    label: str
    odom_from_box: Floats
    """(4, 4), z up, the origin in the middle."""
    size: Floats
    """(3,) length, width, height [m]."""
    variance: float
    """Of its place, in all directions together [m^2]."""
    stamp_ns: int
    """Of the picture."""
    solids: tuple[Solid, ...]
    looks: int = 1
    """Pictures that spoke for this class, less those that spoke for another one."""

    @property
    def middle(self) -> Floats:
        """(3,) of the box around it, in the frame of dead reckoning [m]."""
        return self.odom_from_box[:3, 3]

    def holds(self, other: Body) -> bool:
        """Whether the middle of a smaller one lies inside the outline of this one, and above it."""
        local = inverse_of(self.odom_from_box)[:3] @ np.append(other.middle, 1.0)
        beside = np.abs(local[:2]) > self.size[:2] / 2
        smaller = np.prod(other.size) < _smaller * np.prod(self.size)
        return bool(smaller and not beside.any() and local[2] > -self.size[2] / 2)


class Surroundings:
    """All bodies that were seen, each once."""

    def __init__(self) -> None:
        self.bodies: list[Body] = []

    def see(self, seen: Sequence[Body]) -> None:
        """Take up a picture; things stand still, so that pictures better each other."""
        for body in seen:
            same = [known for known in self.bodies if _is_same(known, body)]
            best = body
            for known in sorted(same, key=lambda one: one.label != body.label):
                best = _agreed(known, best)
            self.bodies = [known for known in self.bodies if known not in same] + [best]

    def nearest(self, label: str, point: Floats, within: float) -> Body | None:
        """The body of a class nearest to a point (2,) or (3,) of the odometry frame, if any."""
        alike = [body for body in self.bodies if body.label == label]
        gaps = [float(np.linalg.norm(body.middle[: len(point)] - point)) for body in alike]
        if not gaps or min(gaps) > within:
            return None
        return alike[int(np.argmin(gaps))]

    def forget(self, body: Body) -> None:
        """It is not there any more."""
        self.bodies = [known for known in self.bodies if known is not body]

    def obstacles(self, odom_from_base: Pose2, without: Body | None = None) -> list[Obstacle]:
        """The shapes within the arm's reach, in the frame of the base."""
        base_from_odom = inverse_of(matrix(odom_from_base.lifted()))
        here = np.array([odom_from_base.x, odom_from_base.y])
        return [
            Obstacle(
                solid.kind,
                base_from_odom @ body.odom_from_box @ solid.box_from_solid,
                solid.size,
                body.label,
            )
            for body in self.bodies
            if body is not without and np.linalg.norm(body.middle[:2] - here) < _near
            for solid in body.solids
        ]


def bodies_in(message: Bodies, labels: Sequence[str]) -> list[Body]:
    """What a picture shows, in the frame of dead reckoning."""
    odom_from_base = matrix(message.odom_from_base.lifted())
    return [
        Body(
            label=label,
            odom_from_box=odom_from_base @ body_frame(message, row),
            size=message.sizes[row],
            variance=float(np.trace(message.covariances[row, :3, :3])),
            stamp_ns=message.stamp_ns,
            solids=_solids(message, row),
        )
        for row, label in enumerate(labels)
    ]


def _solids(message: Bodies, row: int) -> tuple[Solid, ...]:
    made: list[Solid] = []
    for solid in np.flatnonzero(message.solid_rows == row).tolist():
        place = np.eye(4)
        place[:3, 3] = message.solid_centers[solid]
        kind = SOLID_KINDS[int(message.solid_kinds[solid])]
        made.append(Solid(kind, place, message.solid_sizes[solid]))
    return tuple(made)


def _is_same(known: Body, seen: Body) -> bool:
    gap = float(np.linalg.norm(known.middle - seen.middle))
    if known.label == seen.label:
        doubt = 2 * float(np.sqrt(known.variance + seen.variance))
        return gap < min(float(max(known.size.max(), seen.size.max())) / 2 + doubt, _most_apart)
    ratio = float(known.size.max() / seen.size.max())
    return gap < float(seen.size.min()) / 2 and 1 / _alike < ratio < _alike


def _agreed(known: Body, seen: Body) -> Body:
    """What two pictures of one thing say together."""
    if known.label != seen.label:
        # One picture in some shows a thing as what it is not.
        return replace(known, looks=known.looks - 1) if known.looks > 1 else seen
    looks = min(known.looks + 1, _most_looks)
    variance = known.variance + _drift * max((seen.stamp_ns - known.stamp_ns) / 1e9, 0.0)
    if seen.variance > _much_worse * variance:
        return replace(known, looks=looks)
    if variance > _much_worse * seen.variance or not _is_turned_alike(known, seen):
        return replace(seen, looks=looks)
    share = variance / (variance + seen.variance)
    return _moved(known, seen, share, max(share * seen.variance, seen.variance / _alike_pictures))


def _moved(known: Body, seen: Body, share: float, variance: float) -> Body:
    """The newer one, a share of the way from where and how big the older one was to it."""
    frame = seen.odom_from_box.copy()
    frame[:3, 3] = known.middle + share * (seen.middle - known.middle)
    size = known.size + share * (seen.size - known.size)
    return replace(
        seen,
        odom_from_box=frame,
        size=size,
        variance=variance,
        looks=min(known.looks + 1, _most_looks),
    )


def _is_turned_alike(known: Body, seen: Body) -> bool:
    """Whether lengths and widths are those of the same sides."""
    return abs(float(known.odom_from_box[:3, 0] @ seen.odom_from_box[:3, 0])) > _same_side
