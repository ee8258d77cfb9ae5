"""From what is asked for to the task that does it."""

from __future__ import annotations

import numpy as np

from schemas.arrays import Floats
from schemas.task import Handling, HandlingFailure, HandlingGoal
from services.manipulation.errors import RefusalError
from services.manipulation.look_inside import look_inside
from services.manipulation.put_down import put_down
from services.manipulation.stow import stow
from services.manipulation.surroundings import Body
from services.manipulation.take import take
from services.manipulation.workspace import Steps, Workspace

_box_within = 0.5
"""From where a box is said to be it may be so far [m]."""


def task_of(work: Workspace, goal: HandlingGoal) -> Steps:
    """The steps that a goal asks for; a goal that cannot be met fails with the first one."""
    place = _place(work, goal)
    match goal.action:
        case Handling.LOOK:
            return (yield from look_inside(work, _seen_box(work, goal.label, place)))
        case Handling.PICK:
            return (yield from take(work, goal.label, place))
        case Handling.STOW:
            return (yield from stow(work))
        case Handling.PLACE:
            return (yield from put_down(work, place))


def _place(work: Workspace, goal: HandlingGoal) -> Floats:
    """Where the thing is to be (3,), in the frame of dead reckoning [m]."""
    odom_from_thing = work.map_from_odom.inverse().lifted() @ goal.map_from_thing
    return np.array(odom_from_thing.position)


def _seen_box(work: Workspace, label: str, place: Floats) -> Body:
    body = work.surroundings.nearest(label, place[:2], _box_within)
    if body is None:
        raise RefusalError(
            HandlingFailure.LOST, f"no {label} was seen within {_box_within} m of where one is said"
        )
    return body
