"""From a thing in the hand to the motions that put it down: all planned before the arm moves."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from robots.arm import ArmSpec
from robots.arm_kinematics import inverse_of, matrix
from schemas.arrays import Floats
from schemas.geometry import Pose2
from schemas.task import HandlingFailure
from services.manipulation.collision import ArmCollision, Held
from services.manipulation.errors import RefusalError
from services.manipulation.inverse import inverse, representations
from services.manipulation.motions import free_motion, smooth_motion
from services.manipulation.obstacles import Obstacle
from services.manipulation.picking import NEAR_CLEARANCE
from services.manipulation.straight import straight, tool_frame
from services.manipulation.timing import Motion

ABOVE = 0.012
"""What is put down is let go of this far above where it is to stand [m]."""
_above = (0.20, 0.12)
"""From where the hand goes straight down, the first that can be reached [m]."""
_turns = 16
_slow = 0.5
"""Share of the arm's speed with which the hand goes down and leaves."""
_tries = 200


@dataclass(frozen=True)
class Placing:
    """The motions, in order. The gripper opens before `leave`."""

    approach: Motion
    lower: Motion
    leave: Motion


def plan_place(
    arm: ArmSpec,
    held: Held,
    gap: float,
    place: Floats,
    obstacles: Sequence[Obstacle],
    start: Floats,
    rng: Generator,
) -> Placing:
    """Motions that put down what is held, upright, turned as it suits the arm.

    Args:
        arm: with which.
        held: the thing in the hand.
        gap: between the fingers [m].
        place: (3,) where its middle is to be, in the frame of the base [m].
        obstacles: everything else, in the frame of the base.
        start: where the joints are (6,) [rad].
        rng: for the search.

    Raises:
        RefusalError: the place is out of reach, something is in the way, or no way was found.
    """
    loaded = ArmCollision(arm, obstacles, gap, held, NEAR_CLEARANCE)
    postures = _postures(arm, held, place, start)
    if not postures:
        away = float(np.linalg.norm(place - np.array(arm.base_from_foot.position)))
        raise RefusalError(
            HandlingFailure.UNREACHABLE,
            f"the place is {away:.2f} m from the arm's foot, and no posture takes the hand there",
        )
    up = next(_ways_up(arm, loaded, postures[:_tries]), None)
    if up is None:
        reason = loaded.touching(postures[0]) or "the hand cannot go straight down to it"
        raise RefusalError(HandlingFailure.GOAL_IN_COLLISION, f"it cannot be put there: {reason}")
    wide = ArmCollision(arm, obstacles, gap, held)
    return Placing(
        approach=free_motion(arm, wide, start, up[-1:], rng),
        lower=smooth_motion(arm, loaded, up[::-1], _slow),
        leave=smooth_motion(arm, loaded, up, _slow),
    )


def _postures(arm: ArmSpec, held: Held, place: Floats, start: Floats) -> list[Floats]:
    """Postures (6,) that hold the thing over its place, the nearest first."""
    frames = np.stack(
        [matrix(Pose2(0.0, 0.0, k * math.tau / _turns).lifted()) for k in range(_turns)]
    )
    frames[:, :3, 3] = place + np.array([0.0, 0.0, ABOVE])
    flanges = frames @ inverse_of(held.flange_from_shape)
    answers = inverse(arm, inverse_of(matrix(arm.base_from_foot)) @ flanges)
    found = [
        posture
        for joints, valid in zip(answers.joints, answers.valid, strict=True)
        for posture in representations(arm, joints[valid], start)
    ]
    return sorted(found, key=lambda posture: float(np.abs(posture - start).max()))


def _ways_up(arm: ArmSpec, near: ArmCollision, postures: Sequence[Floats]) -> Iterator[Floats]:
    """Straight ways (N, 6) from postures upwards on which nothing touches."""
    for posture in postures:
        for height in _above:
            end = tool_frame(arm, posture)
            end[2, 3] += height
            try:
                way = straight(arm, posture, end)
            except RefusalError:
                continue
            if near.free_along(way):
                yield way
                break
