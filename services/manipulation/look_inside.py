"""The task of looking into an open thing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator, Sequence

import numpy as np

from schemas.arrays import Floats
from schemas.perception import Inspection
from schemas.task import HandlingFailure
from services.manipulation.errors import RefusalError
from services.manipulation.looks import look_into
from services.manipulation.retreat import freed
from services.manipulation.surroundings import Body
from services.manipulation.workspace import (
    SETTLE_NS,
    Grip,
    Move,
    Picture,
    Plan,
    Step,
    Steps,
    Watch,
    Workspace,
)

_box_within = 0.5
"""From where a box is said to be it may be so far [m]."""


def look_inside(work: Workspace, label: str, place: Floats) -> Steps:
    """Hold the wrist's camera over a box and say what is in it.

    Args:
        work: the arm and what it knows.
        label: class of the box.
        place: (3,) its middle, in the frame of dead reckoning [m].

    Raises:
        RefusalError: there is no box, it cannot be seen into, or no picture came.
    """
    if work.grasp:
        raise RefusalError(
            HandlingFailure.FULL, f"the {work.grasp.label} in the gripper hides what is below it"
        )
    yield from freed(work)
    if work.surroundings.nearest(label, place[:2], _box_within) is None:
        yield from overlooked(work, label)
    box = found(work, label, place[:2], _box_within)
    wide = work.arm.gripper.opening
    look = look_into(
        work.robot, work.in_base(box), box.size, work.around(), work.joints, opening=wide
    )
    yield Grip(wide, "opening the gripper")
    motion = work.way_to(look.joints[None])
    yield Plan(f"thinking how to look into the {label}")
    yield Move(motion, f"raising the camera over the {label}")
    pictures = yield from watched(work, f"looking into the {label}")
    inside = _inside(pictures, box)
    work.inspection = _inspection(work, box, look.seen, pictures[-1], inside)
    things = " and ".join(f"a {thing}" for thing in inside) or "nothing"
    return f"there is {things} in the {label}"


def overlooked(work: Workspace, label: str) -> Steps:
    """Look at all that lies before the robot, from above.

    Raises:
        RefusalError: the arm cannot get there, or no picture came.
    """
    motion = work.way_to(np.array([work.arm.poses["look"]]))
    yield Plan(f"thinking how to look at the {label}")
    yield Move(motion, f"looking for the {label}")
    yield from watched(work, f"looking at the {label}")
    return "looked"


def found(work: Workspace, label: str, place: Floats, within: float) -> Body:
    """What was seen of a class nearest to a place (2,) or (3,) of the odometry frame [m].

    Raises:
        RefusalError: there is nothing.
    """
    body = work.surroundings.nearest(label, place, within)
    if body is None:
        raise RefusalError(
            HandlingFailure.LOST, f"no {label} was seen within {within} m of where it is to be"
        )
    return body


def watched(work: Workspace, doing: str) -> Generator[Step, None, list[Picture]]:
    """Wait for pictures that were taken from here.

    Raises:
        RefusalError: none came.
    """
    asked_ns = work.stamp_ns
    yield Watch(doing)
    pictures = work.since(asked_ns + SETTLE_NS)
    if not pictures:
        raise RefusalError(HandlingFailure.BLIND, "the wrist's camera gives no picture")
    return pictures


def _inside(pictures: Sequence[Picture], box: Body) -> tuple[str, ...]:
    """Classes of what lies in a box, as most of the pictures show it."""
    shown = Counter(
        label for one in pictures for label in {b.label for b in one.bodies if box.holds(b)}
    )
    return tuple(sorted(label for label, count in shown.items() if 2 * count > len(pictures)))


def _inspection(
    work: Workspace, box: Body, seen: float, picture: Picture, found: tuple[str, ...]
) -> Inspection:
    return Inspection(
        stamp_ns=picture.stamp_ns,
        odom_from_base=work.odom_from_base,
        label=box.label,
        center_base=_planar(work.in_base(box)),
        seen=seen,
        sought=picture.sought,
        found=found,
    )


def _planar(base_from_box: Floats) -> Floats:
    return np.array(base_from_box[:2, 3])
