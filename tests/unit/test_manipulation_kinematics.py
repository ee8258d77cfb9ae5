"""Laws of the arm's kinematics: both directions agree, everywhere and on every branch."""

import itertools
import math

import numpy as np
import pytest

from robots.arm_kinematics import forward, inverse_of, jacobian, link_frames, matrix, pose
from robots.husky_ur5.spec import UR5
from services.manipulation.inverse import inverse, representations

SINGULAR = {
    "wrist stretched": (0.3, -1.2, 1.5, -0.4, 0.0, 0.7),
    "wrist folded": (0.3, -1.2, 1.5, -0.4, math.pi, 0.7),
    "elbow stretched": (0.3, -1.2, 0.0, -0.4, 1.0, 0.7),
    "nearly so": (0.3, -1.2, 1e-8, -0.4, 1e-8, 0.7),
    "all at zero": (0.0,) * 6,
}


def postures(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-math.pi, math.pi, (count, 6))


def turn_apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    gap = np.abs(a - b)
    return np.minimum(gap, 2 * math.pi - gap).max(axis=-1)


def test_every_branch_puts_the_flange_where_it_was_asked_to() -> None:
    poses = forward(UR5, postures(2000))
    answers = inverse(UR5, poses)
    reached = forward(UR5, np.nan_to_num(answers.joints))
    error = np.abs(reached - poses[:, None]).max(axis=(-1, -2))
    assert error[answers.valid].max() < 1e-9


def test_the_posture_that_made_the_pose_is_among_the_answers() -> None:
    joints = postures(2000, 1)
    answers = inverse(UR5, forward(UR5, joints))
    apart = np.where(answers.valid, turn_apart(answers.joints, joints[:, None]), np.inf)
    found = apart.min(axis=1) < 1e-6
    assert found.mean() >= 0.995


def test_branches_differ_and_are_angles() -> None:
    answers = inverse(UR5, forward(UR5, postures(300, 2)))
    assert answers.valid.sum(axis=1).mean() > 6
    for joints, valid in zip(answers.joints, answers.valid, strict=True):
        assert ((joints[valid] >= -math.pi) & (joints[valid] < math.pi)).all()
        for a, b in itertools.combinations(joints[valid], 2):
            assert turn_apart(a, b) > 1e-6


@pytest.mark.parametrize("name", SINGULAR)
def test_where_branches_meet_the_pose_is_still_reached(name: str) -> None:
    poses = forward(UR5, np.array([SINGULAR[name]]))
    answers = inverse(UR5, poses, last_joint=0.2)
    assert answers.valid.any()
    reached = forward(UR5, answers.joints[answers.valid])
    assert np.abs(reached - poses).max() < 1e-9


def test_beyond_the_reach_there_is_no_answer() -> None:
    far = np.tile(np.eye(4), (2, 1, 1))
    far[0, :3, 3] = (1.2, 0.0, 0.3)
    # Inside the shoulder's own width.
    far[1, :3, 3] = (0.02, 0.0, 0.3)
    assert not inverse(UR5, far).valid.any()


def test_whole_turns_bring_a_posture_near_and_keep_it_within_the_limits() -> None:
    near = np.full(6, 6.0)
    kept = representations(UR5, postures(100, 3), near)
    assert len(kept) == 100
    assert (kept <= UR5.limits.high).all()
    assert np.abs(kept - near).max() <= 2 * math.pi
    same = forward(UR5, kept) - forward(UR5, postures(100, 3))
    assert np.abs(same).max() < 1e-12


def test_the_jacobian_is_the_slope_of_the_kinematics() -> None:
    joints, step = postures(1, 4)[0], 1e-6
    slopes = [
        (forward(UR5, joints + step * axis) - forward(UR5, joints - step * axis)) / (2 * step)
        for axis in np.eye(6)
    ]
    linear = np.array([slope[:3, 3] for slope in slopes]).T
    here = forward(UR5, joints)[:3, :3]
    spins = np.array([slope[:3, :3] @ here.T for slope in slopes])
    angular = np.stack([spins[:, 2, 1], spins[:, 0, 2], spins[:, 1, 0]])
    np.testing.assert_allclose(jacobian(UR5, joints), np.r_[linear, angular], atol=1e-8)


def test_the_published_arm_stretches_as_far_as_its_data_sheet_says() -> None:
    # Stretched out along -x the wrist's centre is both links away, at the shoulder's height.
    frames = link_frames(UR5, np.zeros(6))
    np.testing.assert_allclose(frames[3, :3, 3], (-0.81725, 0.0, 0.089159), atol=1e-9)


def test_poses_and_transforms_are_the_same_thing() -> None:
    transforms = forward(UR5, postures(50, 5))
    for transform in transforms:
        np.testing.assert_allclose(matrix(pose(transform)), transform, atol=1e-12)
    np.testing.assert_allclose(
        inverse_of(transforms) @ transforms, np.tile(np.eye(4), (50, 1, 1)), atol=1e-12
    )
