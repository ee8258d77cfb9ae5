"""Timed motions of the arm on which nothing touches."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from robots.arm import ArmSpec
from schemas.arrays import Floats
from schemas.task import HandlingFailure
from services.manipulation.collision import ArmCollision
from services.manipulation.errors import RefusalError
from services.manipulation.planning import dense, plan
from services.manipulation.timing import Motion, timed

_corner_steps = (10.0, 0.3, 0.1)
"""How finely a way is held to its corners; the finer, the less it swings out and the slower it is
[rad]."""


def free_motion(
    arm: ArmSpec,
    collision: ArmCollision,
    start: Floats,
    goals: Floats,
    rng: Generator,
    pace: float = 1.0,
) -> Motion:
    """From a posture (6,) to one of several (K, 6), around everything.

    Raises:
        RefusalError: as `plan`.
    """
    return smooth_motion(arm, collision, plan(collision, arm.limits, start, goals, rng), pace)


def smooth_motion(
    arm: ArmSpec, collision: ArmCollision, corners: Floats, pace: float = 1.0
) -> Motion:
    """Along a free way (N, 6); its corners are rounded only as far as that is free, too.

    Raises:
        RefusalError: it touches something however closely it keeps to the way.
    """
    reason = ""
    for step in _corner_steps:
        motion = timed(arm.limits, dense(corners, step), pace)
        touches = (collision.touching(joints) for joints in motion.positions)
        reason = next(filter(None, touches), "")
        if not reason:
            return motion
    raise RefusalError(HandlingFailure.NO_PATH, f"on the way {reason}")


def at(motion: Motion, time: float) -> Floats:
    """Joint angles (6,) at a time since the motion began, nearest point [rad]."""
    return motion.positions[int(np.searchsorted(motion.times, time).clip(0, len(motion.times) - 1))]
