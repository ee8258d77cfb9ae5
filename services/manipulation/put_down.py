"""The task of putting down what the gripper holds."""

from __future__ import annotations

import numpy as np

from robots.arm_kinematics import inverse_of, matrix
from schemas.arrays import Floats
from schemas.task import HandlingFailure
from services.manipulation.errors import RefusalError
from services.manipulation.placing import plan_place
from services.manipulation.retreat import freed
from services.manipulation.workspace import Grip, Move, Plan, Steps, Workspace

_room = 0.06
"""By which the fingers open in order to let go [m]."""


def put_down(work: Workspace, place: Floats) -> Steps:
    """Put the thing where it is wanted and leave it there.

    Args:
        work: the arm and what it knows.
        place: (3,) of the middle of the thing, in the frame of dead reckoning [m].

    Raises:
        RefusalError: nothing is held, or it cannot be put there.
    """
    grasp = work.grasp
    if grasp is None:
        raise RefusalError(HandlingFailure.NOT_HELD, "there is nothing in the gripper")
    yield from freed(work)
    base_from_odom = inverse_of(matrix(work.odom_from_base.lifted()))
    spot = (base_from_odom @ np.append(place, 1.0))[:3]
    motions = plan_place(work.arm, grasp.held, work.gap, spot, work.around(), work.joints, work.rng)
    yield Plan(f"thinking where to put the {grasp.label}")
    yield Move(motions.approach, f"carrying the {grasp.label} to its place")
    yield Move(motions.lower, f"putting down the {grasp.label}", to_touch=True)
    # From here on it is not held any more, whatever the fingers say.
    work.grasp = None
    yield Grip(min(work.gap + _room, work.arm.gripper.opening), f"letting go of the {grasp.label}")
    yield Move(motions.leave, "raising the hand")
    return f"the {grasp.label} was put down"
