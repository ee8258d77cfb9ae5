"""The task of taking a thing into the gripper."""

from __future__ import annotations

import numpy as np

from schemas.arrays import Floats
from schemas.task import HandlingFailure
from services.manipulation.errors import RefusalError
from services.manipulation.grasps import Thing
from services.manipulation.holding import is_held
from services.manipulation.look_inside import found, overlooked, watched
from services.manipulation.picking import Pick, plan_pick
from services.manipulation.retreat import freed
from services.manipulation.surroundings import Body
from services.manipulation.workspace import (
    SETTLE_NS,
    Grasp,
    Grip,
    Move,
    Plan,
    Steps,
    Watch,
    Workspace,
)

FOUND_WITHIN = 0.35
"""From where a thing is said to be it may be so far [m]."""
_attempts = 3
_fresh_ns = 5_000_000_000
"""A thing that the wrist's camera saw so long ago need not be looked at again."""
_unmoved = 0.05
"""A thing that is seen this near to where it lay was not taken [m]."""


def take(work: Workspace, label: str, place: Floats) -> Steps:
    """Take hold of a thing and lift it; another way to hold it is tried where one fails.

    Args:
        work: the arm and what it knows.
        label: class of the thing.
        place: (2,) about where it is, in the frame of dead reckoning; how high it lies is seen [m].

    Raises:
        RefusalError: why it is not in the gripper.
    """
    if work.grasp and work.grasp.label == label:
        return f"the {label} is in the gripper already"
    if work.grasp:
        raise RefusalError(HandlingFailure.FULL, f"the gripper holds the {work.grasp.label}")
    yield from freed(work)
    yield from _seen(work, label, place)
    for attempt in range(_attempts):
        body = found(work, label, place, FOUND_WITHIN)
        pick = _planned(work, body, attempt)
        yield Plan(f"thinking how to take the {label}")
        yield from _reach(label, pick)
        if _has(work, pick):
            yield from _lifted(work, body, pick)
            return f"the {label} is in the gripper"
        yield Grip(pick.opening, "opening the gripper")
        yield Move(pick.lift, "raising the empty hand")
        yield from _missed(work, body)
    raise RefusalError(HandlingFailure.NOT_HELD, f"the fingers closed on nothing {_attempts} times")


def _seen(work: Workspace, label: str, place: Floats) -> Steps:
    """Have a look from above first, if the wrist's camera did not just see it."""
    known = work.surroundings.nearest(label, place, FOUND_WITHIN)
    lately = [picture.stamp_ns for picture in work.since(work.stamp_ns - _fresh_ns)]
    if known and known.stamp_ns in lately:
        return "just seen"
    return (yield from overlooked(work, label))


def _planned(work: Workspace, body: Body, skip: int) -> Pick:
    # Of other things than balls the box is known best, whatever they consist of.
    kind = "ball" if body.label == "ball" else "box"
    thing = Thing(kind, work.in_base(body), body.size)
    return plan_pick(work.arm, thing, work.around(without=body), work.joints, work.rng, skip=skip)


def _reach(label: str, pick: Pick) -> Steps:
    yield Grip(pick.opening, "opening the gripper")
    yield Move(pick.approach, f"reaching for the {label}")
    yield Move(pick.descend, f"going down to the {label}")
    yield Grip(pick.grip, f"closing on the {label}")
    return "closed"


def _has(work: Workspace, pick: Pick) -> bool:
    return is_held(work.arm.gripper, work.gap, pick.grip, pick.width)


def _lifted(work: Workspace, body: Body, pick: Pick) -> Steps:
    """Lift it; whether it came along is told by the fingers and by the camera."""
    work.grasp = Grasp(body.label, pick.held, pick.grip, pick.width)
    work.surroundings.forget(body)
    yield Move(pick.lift, f"lifting the {body.label}")
    asked_ns = work.stamp_ns
    # Where no picture comes the fingers alone are believed.
    yield Watch(f"looking whether the {body.label} came along", pictures=1)
    after = work.since(asked_ns + SETTLE_NS)
    if any(_lies_there(one, body) for picture in after for one in picture.bodies):
        work.grasp = None
        raise RefusalError(
            HandlingFailure.NOT_HELD, f"the {body.label} still lies where it was before"
        )
    return "lifted"


def _missed(work: Workspace, body: Body) -> Steps:
    """After a grasp that failed: is it still there?

    Raises:
        RefusalError: it is not.
    """
    pictures = yield from watched(work, f"looking where the {body.label} is")
    seen = [one for picture in pictures for one in picture.bodies if one.label == body.label]
    if not any(_lies_there(one, body) for one in seen):
        work.surroundings.forget(body)
    if not seen:
        raise RefusalError(HandlingFailure.LOST, f"the {body.label} is gone")
    return "seen again"


def _lies_there(seen: Body, before: Body) -> bool:
    same = seen.label == before.label
    return same and float(np.linalg.norm(seen.middle - before.middle)) < _unmoved
