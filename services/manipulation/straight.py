"""The hand on a straight line: reaching for a thing, and lifting it."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from robots.arm import ArmSpec
from robots.arm_kinematics import forward, inverse_of, matrix
from schemas.arrays import Floats
from schemas.task import HandlingFailure
from services.manipulation.errors import RefusalError
from services.manipulation.inverse import inverse, representations

_step = 0.01
"""Between points of the line [m]."""
_turn_step = 0.05
"""[rad]"""
_jump = 0.35
"""More than this from one point to the next is another posture, not a motion [rad]."""


def tool_frame(arm: ArmSpec, joints: Floats) -> Floats:
    """`base_from_tool` (..., 4, 4) at joint angles (..., 6) [rad]."""
    base_from_flange = matrix(arm.base_from_foot) @ forward(arm, joints)
    return base_from_flange @ matrix(arm.flange_from_tool)


def flange_frames(arm: ArmSpec, base_from_tool: Floats) -> Floats:
    """`foot_from_flange` (..., 4, 4) for poses of the tool."""
    foot_from_tool = inverse_of(matrix(arm.base_from_foot)) @ base_from_tool
    return foot_from_tool @ inverse_of(matrix(arm.flange_from_tool))


def straight(arm: ArmSpec, start: Floats, base_from_tool: Floats) -> Floats:
    """Postures (N, 6) on the straight line of the tool from where it is at `start` (6,) [rad].

    Raises:
        RefusalError: the arm does not reach all of the line without changing its posture.
    """
    frames = _line(tool_frame(arm, start), base_from_tool)
    answers = inverse(arm, flange_frames(arm, frames), last_joint=float(start[5]))
    way = [start]
    for joints, valid in zip(answers.joints[1:], answers.valid[1:], strict=True):
        near = representations(arm, joints[valid], way[-1])
        gaps = np.abs(near - way[-1]).max(axis=1, initial=0.0)
        if not len(near) or gaps.min() > _jump:
            raise RefusalError(
                HandlingFailure.NO_PATH,
                f"the hand cannot go on straight after {len(way)} of {len(frames)} steps",
            )
        way.append(near[int(np.argmin(gaps))])
    return np.array(way)


def _line(start: Floats, end: Floats) -> Floats:
    """Frames (N, 4, 4) from one to the other, evenly moved and turned."""
    turns = Rotation.from_matrix(np.stack([start[:3, :3], end[:3, :3]]))
    angle = float((turns[0].inv() * turns[1]).magnitude())
    length = float(np.linalg.norm(end[:3, 3] - start[:3, 3]))
    count = max(1, int(np.ceil(max(length / _step, angle / _turn_step))))
    shares = np.linspace(0.0, 1.0, count + 1)
    frames = np.tile(np.eye(4), (count + 1, 1, 1))
    frames[:, :3, :3] = Slerp([0.0, 1.0], turns)(shares).as_matrix()
    frames[:, :3, 3] = start[:3, 3] + shares[:, None] * (end[:3, 3] - start[:3, 3])
    return frames
