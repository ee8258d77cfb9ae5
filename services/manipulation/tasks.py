"""From what is asked for to the task that does it."""

from __future__ import annotations

import numpy as np

from schemas.arrays import Floats
from schemas.task import Handling, HandlingGoal
from services.manipulation.look_inside import look_inside
from services.manipulation.put_down import put_down
from services.manipulation.stow import stow
from services.manipulation.take import take
from services.manipulation.workspace import Steps, Workspace


def task_of(work: Workspace, goal: HandlingGoal) -> Steps:
    """The steps that a goal asks for; a goal that cannot be met fails with the first one."""
    place = _place(work, goal)
    match goal.action:
        case Handling.LOOK:
            return (yield from look_inside(work, goal.label, place))
        case Handling.PICK:
            return (yield from take(work, goal.label, place[:2]))
        case Handling.STOW:
            return (yield from stow(work))
        case Handling.PLACE:
            return (yield from put_down(work, place))


def _place(work: Workspace, goal: HandlingGoal) -> Floats:
    """Where the thing is to be (3,), in the frame of dead reckoning [m]."""
    odom_from_thing = work.map_from_odom.inverse().lifted() @ goal.map_from_thing
    return np.array(odom_from_thing.position)
