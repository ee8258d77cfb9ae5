"""The task of looking into an open thing."""

from __future__ import annotations

import numpy as np

from schemas.arrays import Floats
from schemas.perception import Inspection
from schemas.task import HandlingFailure
from services.manipulation.errors import RefusalError
from services.manipulation.looks import look_into
from services.manipulation.retreat import freed
from services.manipulation.surroundings import Body
from services.manipulation.workspace import Grip, Move, Plan, Steps, Watch, Workspace


def look_inside(work: Workspace, box: Body) -> Steps:
    """Hold the wrist's camera over a box and say what is in it.

    Args:
        work: the arm and what it knows.
        box: as it was seen, or as whoever asks takes it to be.

    Raises:
        RefusalError: the box cannot be seen into, or no picture came.
    """
    if work.grasp:
        raise RefusalError(
            HandlingFailure.FULL, f"the {work.grasp.label} in the gripper hides what is below it"
        )
    yield from freed(work)
    wide = work.arm.gripper.opening
    look = look_into(
        work.robot, work.in_base(box), box.size, work.around(), work.joints, opening=wide
    )
    yield Grip(wide, "opening the gripper")
    motion = work.way_to(look.joints[None])
    yield Plan(f"thinking how to look into the {box.label}")
    yield Move(motion, f"raising the camera over the {box.label}")
    yield from watched(work, f"looking into the {box.label}")
    found = tuple(body.label for body in work.watched if box.holds(body))
    work.inspection = _inspection(work, box, look.seen, found)
    things = " and ".join(f"a {label}" for label in found) or "nothing"
    return f"there is {things} in the {box.label}"


def watched(work: Workspace, doing: str) -> Steps:
    """Wait for a picture that was taken from here.

    Raises:
        RefusalError: none came.
    """
    asked_ns = work.stamp_ns
    yield Watch(doing)
    if work.watched_ns <= asked_ns:
        raise RefusalError(HandlingFailure.BLIND, "the wrist's camera gave no picture")
    return "seen"


def _inspection(work: Workspace, box: Body, seen: float, found: tuple[str, ...]) -> Inspection:
    return Inspection(
        stamp_ns=work.watched_ns,
        odom_from_base=work.odom_from_base,
        label=box.label,
        center_base=_planar(work.in_base(box)),
        seen=seen,
        sought=work.sought,
        found=found,
    )


def _planar(base_from_box: Floats) -> Floats:
    return np.array(base_from_box[:2, 3])
