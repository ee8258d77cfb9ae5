"""Motions of the arm: they touch nothing, keep to the limits, and are refused with a reason."""

import numpy as np
import pytest

from robots.arm_kinematics import matrix
from robots.husky_ur5.spec import HUSKY_UR5, UR5
from schemas.geometry import Pose2, Pose3
from schemas.perception import SOLID_KINDS, Bodies
from schemas.task import HandlingFailure
from services.manipulation import planning
from services.manipulation.collision import ArmCollision, Held
from services.manipulation.errors import RefusalError
from services.manipulation.following import Follower, Progress
from services.manipulation.holding import grip_opening, is_held
from services.manipulation.motions import at, free_motion
from services.manipulation.obstacles import box, from_bodies, own_body
from services.manipulation.planning import dense, plan
from services.manipulation.straight import straight, tool_frame
from services.manipulation.timing import timed

STOW, LOOK, CARRY = (np.array(UR5.poses[name]) for name in ("stow", "look", "carry"))
DOWN = STOW + np.array([0, 1.6, 0, 0, 0, 0])
LEFT = LOOK + np.array([1.6, 0, 0, 0, 0, 0])
POST = box("post", (0.72, 0.27, 0.6), (0.08, 0.08, 1.2))
HERE = Pose3((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def among(*obstacles, opening=0.0, held=None) -> ArmCollision:
    return ArmCollision(UR5, [*own_body(HUSKY_UR5), *obstacles], opening, held)


@pytest.mark.parametrize("name", UR5.poses)
@pytest.mark.parametrize("opening", [0.0, UR5.gripper.opening])
def test_named_poses_touch_nothing(name: str, opening: float) -> None:
    assert among(opening=opening).touching(np.array(UR5.poses[name])) == ""


def test_a_way_leads_around_what_stands_between() -> None:
    collision = among(POST)
    assert not collision.free_along(dense(np.stack([LOOK, LEFT])))
    way = plan(collision, UR5.limits, LOOK, LEFT[None], rng())
    np.testing.assert_array_equal(way[[0, -1]], [LOOK, LEFT])
    assert collision.free_along(dense(way))


def test_the_same_question_gets_the_same_answer() -> None:
    once, again = (plan(among(POST), UR5.limits, LOOK, LEFT[None], rng()) for _ in range(2))
    np.testing.assert_array_equal(once, again)


def test_the_nearest_free_goal_is_taken() -> None:
    way = plan(among(), UR5.limits, STOW, np.array([DOWN, LEFT, LOOK]), rng())
    np.testing.assert_array_equal(way[-1], LOOK)


@pytest.mark.parametrize(
    ("start", "goal", "around", "failure", "words"),
    [
        (LOOK, STOW, box("box", (0.8, 0, 0.8), (0.3, 0.3, 0.3)), "start_in_collision", "box"),
        (STOW, LOOK, box("box", (0.8, 0, 0.8), (0.3, 0.3, 0.3)), "goal_in_collision", "box"),
        (STOW, DOWN, POST, "goal_in_collision", "touches the"),
    ],
)
def test_what_touches_is_refused_in_words(start, goal, around, failure, words) -> None:
    with pytest.raises(RefusalError, match=words) as refused:
        plan(among(around), UR5.limits, start, goal[None], rng())
    assert refused.value.failure == failure


def test_a_search_that_is_used_up_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(planning, "MOST_CHECKS", 20)
    with pytest.raises(RefusalError, match=r"in 2\d postures") as refused:
        plan(among(POST), UR5.limits, LOOK, LEFT[None], rng())
    assert refused.value.failure is HandlingFailure.NO_PATH


def test_what_is_held_may_not_touch_either() -> None:
    near = box("wall", (0.55, 0.25, 0.62), (0.3, 0.04, 0.4))
    below = matrix(UR5.flange_from_tool)
    held = Held("box", below, np.array([0.10, 0.50, 0.10]))
    assert among(near).free(CARRY)
    assert "thing in the gripper" in among(near, held=held).touching(CARRY)


def test_a_motion_keeps_to_speeds_and_accelerations_and_rests_at_both_ends() -> None:
    motion = free_motion(UR5, among(POST), LOOK, LEFT[None], rng())
    assert (np.abs(motion.velocities) <= UR5.limits.speed).all()
    rates = np.abs(np.diff(motion.velocities, axis=0)) / np.diff(motion.times)[:, None]
    assert (rates <= UR5.limits.acceleration).all()
    assert not motion.velocities[[0, -1]].any()
    # Positions are the integral of velocities.
    means = (motion.velocities[1:] + motion.velocities[:-1]) / 2
    moved = motion.positions[0] + np.cumsum(means * np.diff(motion.times)[:, None], axis=0)
    np.testing.assert_allclose(moved[-1], LEFT, atol=0.05)


def test_a_straight_way_takes_as_long_as_the_slowest_joint_needs() -> None:
    goal = STOW + np.array([1.0, 0.2, 0, 0, 0, 0])
    motion = timed(UR5.limits, np.stack([STOW, goal]))
    speed, acceleration = UR5.limits.speed[0], UR5.limits.acceleration[0]
    least = 1.0 / speed + speed / acceleration
    assert least < motion.duration < 1.4 * least


def test_a_motion_to_where_the_arm_is_is_none() -> None:
    motion = timed(UR5.limits, np.stack([STOW, STOW]))
    np.testing.assert_allclose(motion.positions, np.tile(STOW, (len(motion.times), 1)))


def test_the_hand_goes_straight() -> None:
    end = tool_frame(UR5, LOOK)
    end[2, 3] -= 0.2
    way = straight(UR5, LOOK, end)
    tools = tool_frame(UR5, way)
    np.testing.assert_allclose(tools[-1], end, atol=1e-9)
    np.testing.assert_allclose(tools[:, :2, 3], np.tile(end[:2, 3], (len(way), 1)), atol=1e-9)
    assert np.abs(np.diff(way, axis=0)).max() < 0.2


def test_the_hand_does_not_go_where_the_arm_ends() -> None:
    end = tool_frame(UR5, LOOK)
    end[0, 3] += 1.0
    with pytest.raises(RefusalError, match="steps"):
        straight(UR5, LOOK, end)


def test_solids_of_perception_become_obstacles_and_move_with_the_robot() -> None:
    bodies = Bodies(
        stamp_ns=0,
        odom_from_base=Pose2(0.0, 0.0, 0.0),
        positions_base=np.array([[1.0, 0.0, 0.1], [2.0, 0.0, 0.1]]),
        wxyz_base=np.array([[1.0, 0, 0, 0]] * 2),
        covariances=np.zeros((2, 6, 6)),
        sizes=np.full((2, 3), 0.2),
        solid_rows=np.array([0, 1], np.int32),
        solid_kinds=np.array([SOLID_KINDS.index("box"), SOLID_KINDS.index("ball")], np.int32),
        solid_centers=np.array([[0.0, 0.0, 0.05], [0.0, 0.0, 0.0]]),
        solid_sizes=np.full((2, 3), 0.2),
    )
    half_a_metre_ahead = Pose3((-0.5, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    only = from_bodies(bodies, ("box", "ball"), half_a_metre_ahead, without=1)
    assert [(o.kind, o.name) for o in only] == [("box", "box")]
    np.testing.assert_allclose(only[0].base_from_shape[:3, 3], (0.5, 0.0, 0.15))


@pytest.mark.parametrize(
    ("gap", "held"), [(0.10, True), (0.095, True), (0.07, False), (0.16, False), (0.02, False)]
)
def test_fingers_tell_what_they_hold(gap: float, held: bool) -> None:
    assert is_held(UR5.gripper, gap, grip_opening(0.10), 0.10) is held


def test_an_arm_that_does_not_follow_is_noticed_and_one_that_does_arrives() -> None:
    motion = timed(UR5.limits, np.stack([STOW, LOOK]))
    following, stuck = Follower(motion, "a", 0), Follower(motion, "b", 0)
    ends = set()
    for tick in range(200):
        now = tick * 50_000_000
        there = at(motion, now / 1e9)
        ends.add((following.watch(there, now), stuck.watch(STOW, now)))
    assert {one for one, _ in ends} == {Progress.MOVING, Progress.ARRIVED}
    assert {other for _, other in ends} == {Progress.MOVING, Progress.STUCK}
