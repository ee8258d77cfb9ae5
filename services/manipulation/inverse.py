"""Joint angles of an arm of the UR's kind for poses of its flange: all of them, in closed form.

The arm is one whose second, third and fourth axes are parallel. Then the first joint puts the plane
of these three, the fifth and sixth turn the flange, and what is left is an arm of two links in a
plane (Hawkins, "Analytic inverse kinematics for the universal robots", 2013). Each step has two
answers: shoulder left or right, wrist up or down, elbow up or down.

Angles come from both legs of a triangle (arctan2), never from the cosine alone, which is blind
where the answers meet.
"""

from dataclasses import dataclass

import numpy as np

from robots.arm import ArmSpec
from robots.arm_kinematics import inverse_of, joint_steps
from schemas.arrays import Flags, Floats

BRANCHES = 8
_rim = 1e-9
"""Beyond the reach by less than this is taken for rounding [share of a squared length]."""
_aligned = 1e-9
"""Sine of the fifth joint below which the fourth and sixth axes count as parallel."""
_same = 1e-6
"""Branches closer than this in every joint are one [rad]."""


@dataclass(frozen=True)
class Solutions:
    """Answers for N poses."""

    joints: Floats
    """(N, 8, 6) in [-pi, pi) [rad]; NaN where there is no answer."""
    valid: Flags
    """(N, 8), without answers that another branch has already given."""


def inverse(arm: ArmSpec, foot_from_flange: Floats, last_joint: float = 0.0) -> Solutions:
    """All joint angles that put the flange somewhere.

    Args:
        arm: whose flange.
        foot_from_flange: poses (N, 4, 4).
        last_joint: angle of the sixth joint where the pose leaves it open [rad].

    Returns:
        Up to eight answers a pose.
    """
    poses = np.asarray(foot_from_flange, np.float64)
    first = _first(arm, poses)[:, :, None, None]
    fifth, sixth = _wrist(arm, poses, first[..., 0], last_joint)
    second, third, fourth = _plane(arm, poses, first[..., 0], fifth, sixth)
    angles = [first, second, third, fourth, fifth[..., None], sixth[..., None]]
    joints = np.stack(np.broadcast_arrays(*angles), axis=-1).reshape(len(poses), BRANCHES, 6)
    joints = (joints + np.pi) % (2 * np.pi) - np.pi
    return Solutions(joints, _distinct(joints))


def representations(arm: ArmSpec, joints: Floats, near: Floats) -> Floats:
    """The same postures (K, 6) with whole turns added: within the limits and nearest to `near`.

    Postures that no whole turns bring within the limits are left out.
    """
    low, high = np.array(arm.limits.low), np.array(arm.limits.high)
    turns = 2 * np.pi * np.round((near - joints) / (2 * np.pi))
    shifted = joints + turns
    shifted += 2 * np.pi * ((shifted < low).astype(float) - (shifted > high))
    return shifted[((shifted >= low) & (shifted <= high)).all(axis=1)]


def _first(arm: ArmSpec, poses: Floats) -> Floats:
    """Both angles (N, 2) that bring the plane of the arm to the wrist; NaN inside the shoulder."""
    wrist = poses[:, :3, 3] - arm.d[5] * poses[:, :3, 2]
    x, y, offset = wrist[:, 0], wrist[:, 1], arm.d[3]
    along = _leg(x**2 + y**2 - offset**2, offset**2)
    return np.stack(
        [
            np.arctan2(y, x) - np.arctan2(-offset, along),
            np.arctan2(y, x) - np.arctan2(-offset, -along),
        ],
        axis=1,
    )


def _wrist(arm: ArmSpec, poses: Floats, first: Floats, last_joint: float) -> tuple[Floats, Floats]:
    """Fifth and sixth angles, each (N, 2, 2)."""
    # Rows of the flange's axes along the normal of the arm's plane.
    normal = np.stack([np.sin(first), -np.cos(first), np.zeros_like(first)], axis=-1)
    across = np.einsum("nsxk,nkj->nsj", normal, poses[:, :3, :3])
    sine = np.hypot(across[..., 0], across[..., 1])
    fifth = np.stack([np.arctan2(sine, across[..., 2]), np.arctan2(-sine, across[..., 2])], axis=-1)
    sign = np.array([1.0, -1.0])
    sixth = np.arctan2(-across[..., None, 1] * sign, across[..., None, 0] * sign)
    free = sine[..., None] < _aligned
    return fifth, np.where(free, last_joint, sixth)


def _plane(
    arm: ArmSpec, poses: Floats, first: Floats, fifth: Floats, sixth: Floats
) -> tuple[Floats, Floats, Floats]:
    """Second to fourth angles, each (N, 2, 2, 2): those of a planar arm of two links and a hand."""
    shoulder = joint_steps(arm, np.broadcast_to(first, fifth.shape)[..., None], slice(0, 1))
    hand = joint_steps(arm, np.stack([fifth, sixth], axis=-1), slice(4, 6))
    fourth_frames = (
        inverse_of(shoulder[..., 0, :, :])
        @ poses[:, None, None]
        @ inverse_of(hand[..., 0, :, :] @ hand[..., 1, :, :])
    )
    x = fourth_frames[..., 0, 3] - arm.d[3] * fourth_frames[..., 0, 1]
    y = fourth_frames[..., 1, 3] - arm.d[3] * fourth_frames[..., 1, 1]
    upper, fore = arm.a[1], arm.a[2]
    cosine = (x**2 + y**2 - upper**2 - fore**2) / (2 * upper * fore)
    bend = np.arctan2(_leg(1 - cosine**2, 1.0), cosine)
    third = np.stack([bend, -bend], axis=-1)
    second = np.arctan2(y, x)[..., None] - np.arctan2(
        fore * np.sin(third), upper + fore * np.cos(third)
    )
    # The hand's direction is the sum of all three.
    whole = np.arctan2(fourth_frames[..., 1, 0], fourth_frames[..., 0, 0])[..., None]
    return second, third, whole - second - third


def _leg(square: Floats, scale: float) -> Floats:
    """Root of a square that may be a little below zero by rounding; NaN if it is more."""
    rounded = np.where(np.abs(square) < _rim * scale, np.maximum(square, 0.0), square)
    return np.sqrt(np.where(rounded < 0, np.nan, rounded))


def _distinct(joints: Floats) -> Flags:
    """Which branches (N, 8) exist and repeat none before them."""
    valid = np.asarray(np.isfinite(joints).all(axis=-1))
    gap = np.abs(joints[:, :, None] - joints[:, None])
    gap = np.minimum(gap, 2 * np.pi - gap).max(axis=-1)
    earlier = np.tril(np.ones((BRANCHES, BRANCHES), np.bool_), -1)
    repeats = np.less(gap, _same) & valid[:, np.newaxis] & earlier
    return valid & ~repeats.any(axis=2)
