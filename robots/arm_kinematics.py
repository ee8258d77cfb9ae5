"""Where an arm's links are for given joint angles, and how they move; for many at once."""

from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

from robots.arm import ArmSpec
from schemas.arrays import Floats
from schemas.geometry import Pose3


def link_frames(arm: ArmSpec, joints: Floats) -> Floats:
    """Frames of the foot and of all links in the foot's frame.

    Args:
        arm: whose links.
        joints: angles (..., 6) [rad].

    Returns:
        Homogeneous transforms (..., 7, 4, 4), `foot_from_link`.
    """
    steps = joint_steps(arm, np.asarray(joints, np.float64))
    frames = np.empty((*steps.shape[:-3], 7, 4, 4))
    frames[..., 0, :, :] = np.eye(4)
    for link in range(6):
        frames[..., link + 1, :, :] = frames[..., link, :, :] @ steps[..., link, :, :]
    return frames


def forward(arm: ArmSpec, joints: Floats) -> Floats:
    """`foot_from_flange` (..., 4, 4) for joint angles (..., 6) [rad]."""
    return link_frames(arm, joints)[..., 6, :, :]


def jacobian(arm: ArmSpec, joints: Floats) -> Floats:
    """How the flange moves with the joints, in the foot's frame.

    Args:
        arm: whose flange.
        joints: angles (..., 6) [rad].

    Returns:
        (..., 6, 6): velocity [m/rad] over rotation [rad/rad], one column a joint.
    """
    frames = link_frames(arm, joints)
    axes, origins = frames[..., :6, :3, 2], frames[..., :6, :3, 3]
    arms = frames[..., 6:7, :3, 3] - origins
    columns = np.concatenate([np.cross(axes, arms), axes], axis=-1)
    return np.swapaxes(columns, -1, -2)


def joint_steps(arm: ArmSpec, angles: Floats, joints: slice = slice(0, 6)) -> Floats:
    """`previous_from_link` (..., J, 4, 4) of J successive joints at angles (..., J) [rad]."""
    made = np.zeros((*angles.shape, 4, 4))
    cos, sin = np.cos(angles), np.sin(angles)
    a, d, cos_twist, sin_twist = (column[joints] for column in _lengths(arm.a, arm.d, arm.alpha))
    made[..., 0, 0], made[..., 1, 0] = cos, sin
    made[..., 0, 1], made[..., 1, 1] = -sin * cos_twist, cos * cos_twist
    made[..., 0, 2], made[..., 1, 2] = sin * sin_twist, -cos * sin_twist
    made[..., 0, 3], made[..., 1, 3] = a * cos, a * sin
    made[..., 2, 1], made[..., 2, 2], made[..., 2, 3] = sin_twist, cos_twist, d
    made[..., 3, 3] = 1.0
    return made


def matrix(pose: Pose3) -> Floats:
    """A pose as a homogeneous transform (4, 4)."""
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = pose.rotation(), pose.position
    return made


def pose(transform: Floats) -> Pose3:
    """A homogeneous transform (4, 4) as a pose; inverse of `matrix`."""
    x, y, z = transform[:3, 3].tolist()
    turn = Rotation.from_matrix(transform[:3, :3]).as_quat(canonical=True, scalar_first=True)
    w, qx, qy, qz = turn.tolist()
    return Pose3((x, y, z), (w, qx, qy, qz))


def inverse_of(transforms: Floats) -> Floats:
    """Inverse of rigid transforms (..., 4, 4)."""
    made = np.zeros_like(transforms)
    turned = np.swapaxes(transforms[..., :3, :3], -1, -2)
    made[..., :3, :3] = turned
    made[..., :3, 3] = -(turned @ transforms[..., :3, 3:])[..., 0]
    made[..., 3, 3] = 1.0
    return made


@lru_cache
def _lengths(a: tuple[float, ...], d: tuple[float, ...], alpha: tuple[float, ...]) -> list[Floats]:
    # The cosine of a right angle is not quite 0 in floating point; a twist is meant exactly.
    twists = np.array(alpha)
    return [np.array(a), np.array(d), np.cos(twists).round(15), np.sin(twists).round(15)]
