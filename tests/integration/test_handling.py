"""The arm's process at work in the simulator; what goes wrong is said, and nothing thrown."""

import numpy as np
import pytest

pytest.importorskip("sapien")

from robots.husky_ur5.spec import UR5
from schemas.geometry import Pose2, Pose3
from schemas.motion import BaseCommand
from schemas.task import Handling, HandlingFailure, TaskState
from sim.experiments.box_pick import BOX, THING
from tests.integration.handling import Stage

pytestmark = pytest.mark.slow
LEVEL = (1.0, 0.0, 0.0, 0.0)


@pytest.fixture
def stage():
    made = Stage()
    yield made
    made.close()


def beside(stage: Stage) -> Pose3:
    """A free place on the side where no other box stands."""
    side = -np.sign(stage.world.find("other").world_from_object.y)
    return Pose3((0.75, 0.5 * float(side), 0.05), LEVEL)


def take(stage: Stage) -> None:
    status = stage.do(Handling.PICK)
    assert (status.failure, status.holding) == (None, "ball"), status.reason


def test_a_look_says_what_is_in_the_box(stage: Stage) -> None:
    status = stage.do(Handling.LOOK, BOX)
    assert status.state is TaskState.SUCCEEDED, status.reason
    (inspection,) = stage.inspections
    assert inspection.found == ("ball",)
    assert "cracker box" in inspection.sought
    assert inspection.seen > 0.9
    box = stage.world.find(BOX).world_from_object
    np.testing.assert_allclose(inspection.center_base, [box.x, box.y], atol=0.03)


def test_an_empty_box_is_told_too(stage: Stage) -> None:
    stage.driver.loose.take_away(THING)
    assert stage.do(Handling.LOOK, BOX).state is TaskState.SUCCEEDED
    assert stage.inspections[0].found == ()
    assert "ball" in stage.inspections[0].sought


def test_the_ball_is_looked_at_taken_carried_and_put_down(stage: Stage) -> None:
    assert stage.do(Handling.LOOK, BOX).failure is None
    take(stage)
    assert stage.height > 0.25
    assert stage.do(Handling.STOW).holding == "ball"
    assert stage.height > 0.3
    status = stage.do(Handling.PLACE, at=beside(stage))
    assert (status.failure, status.holding) == (None, ""), status.reason
    assert stage.do(Handling.STOW).state is TaskState.SUCCEEDED
    lies_at = np.array(stage.driver.loose.poses[THING].position)[:2]
    np.testing.assert_allclose(lies_at, beside(stage).position[:2], atol=0.05)
    np.testing.assert_allclose(stage.driver.arm_joints, UR5.poses["stow"], atol=0.03)
    assert stage.force < 1.0
    assert stage.now_s < 30.0


def test_what_vanishes_during_the_reach_is_lost_and_the_hand_comes_back(stage: Stage) -> None:
    stage.do(Handling.PICK, until=stage.doing("going down"))
    stage.driver.loose.take_away(THING)
    status = stage.wait_for_end()
    assert (status.state, status.failure) == (TaskState.FAILED, HandlingFailure.LOST)
    assert status.reason == "the ball is gone"
    assert stage.do(Handling.STOW).state is TaskState.SUCCEEDED
    assert stage.force < 1.0


def test_what_rolls_away_during_the_reach_is_taken_at_the_second_try(stage: Stage) -> None:
    stage.do(Handling.PICK, until=stage.doing("closing"))
    pose = stage.driver.loose.poses[THING]
    box = stage.world.find(BOX).world_from_object.lifted()
    middle = np.array(box.position)
    away = middle + 0.5 * (middle - np.array(pose.position))
    stage.driver.loose.place({THING: Pose3((*away[:2].tolist(), 0.02), LEVEL)})
    status = stage.wait_for_end()
    assert status.holding == "ball", status.reason


@pytest.mark.parametrize("seconds", [0.0, 3.0])
def test_what_falls_is_noticed_at_work_and_at_rest(stage: Stage, seconds: float) -> None:
    take(stage)
    stage.wait(seconds)
    if seconds == 0.0:
        stage.do(Handling.STOW, until=stage.doing("carrying"))
    stage.driver.loose.take_away(THING)
    stage.wait(1.0)
    status = stage.statuses[-1]
    assert (status.state, status.failure) == (TaskState.FAILED, HandlingFailure.DROPPED)
    assert (status.reason, status.holding) == ("the ball fell", "")


@pytest.mark.parametrize("joint", [UR5.joints[1], UR5.joints[5]])
def test_an_arm_that_does_not_move_is_said_to_be_stuck(stage: Stage, joint: str) -> None:
    stage.do(Handling.LOOK, BOX, until=stage.doing("raising"))
    stage.driver.jam_joint(joint)
    status = stage.wait_for_end()
    assert status.failure is HandlingFailure.STUCK
    assert "the arm does not move" in status.reason


def test_a_stop_holds_arm_and_ball_and_the_carry_goes_on_when_asked_again(stage: Stage) -> None:
    take(stage)
    stage.do(Handling.STOW, until=stage.doing("carrying"))
    stage.wait(0.3)
    stage.stop(True)
    stage.wait(1.0)
    status = stage.statuses[-1]
    assert (status.state, status.holding) == (TaskState.CANCELLED, "ball")
    stood, high = stage.driver.arm_joints, stage.height
    stage.wait(3.0)
    np.testing.assert_allclose(stage.driver.arm_joints, stood, atol=2e-3)
    assert stage.height == pytest.approx(high, abs=5e-3)
    assert stage.do(Handling.STOW).state is TaskState.CANCELLED
    stage.stop(False)
    assert stage.do(Handling.STOW).state is TaskState.SUCCEEDED
    np.testing.assert_allclose(stage.driver.arm_joints, UR5.poses["carry"], atol=0.03)
    assert stage.statuses[-1].holding == "ball"


def test_a_stop_in_the_box_ends_the_reach_and_the_hand_finds_out_again(stage: Stage) -> None:
    stage.do(Handling.PICK, until=stage.doing("closing"))
    stage.stop(True)
    stage.wait(1.0)
    stage.stop(False)
    status = stage.do(Handling.STOW)
    assert status.state is TaskState.SUCCEEDED, status.reason
    assert stage.force < 30.0


def test_a_blinded_camera_is_said(stage: Stage) -> None:
    stage.do(Handling.LOOK, BOX)
    stage.eyes.blind = True
    status = stage.do(Handling.LOOK, BOX)
    assert (status.state, status.failure) == (TaskState.FAILED, HandlingFailure.BLIND)
    assert len(stage.inspections) == 1


def test_with_the_camera_blinded_on_the_way_the_fingers_are_believed(stage: Stage) -> None:
    stage.do(Handling.PICK, until=stage.doing("lifting"))
    stage.eyes.blind = True
    assert stage.wait_for_end().holding == "ball"


def test_what_is_not_there_is_lost(stage: Stage) -> None:
    far = Pose3((0.9, -1.6, 0.05), LEVEL)
    status = stage.do(Handling.PICK, at=far)
    assert status.failure is HandlingFailure.LOST
    assert "no ball was seen within" in status.reason


def test_what_was_seen_too_far_away_is_out_of_reach(stage: Stage) -> None:
    stage.do(Handling.LOOK, BOX)
    backwards = -0.4
    while stage.driver.world_from_base.x > -1.0:
        command = BaseCommand(
            stamp_ns=stage.driver.stamp_ns, linear=backwards, angular=0.0, valid_ms=300
        )
        stage.driver.command(command)
        stage.wait(0.1)
    stage.wait(1.0)
    status = stage.do(Handling.PICK)
    assert status.failure is HandlingFailure.UNREACHABLE
    assert "from the arm's foot" in status.reason


def test_a_base_that_drives_off_ends_the_work(stage: Stage) -> None:
    stage.do(Handling.LOOK, BOX, until=stage.doing("raising"))
    for _ in range(10):
        command = BaseCommand(
            stamp_ns=stage.driver.stamp_ns, linear=-0.4, angular=0.0, valid_ms=300
        )
        stage.driver.command(command)
        stage.wait(0.1)
    status = stage.statuses[-1]
    assert status.state is TaskState.FAILED
    assert "the base moved" in status.reason


def test_a_full_hand_takes_and_looks_at_nothing_else(stage: Stage) -> None:
    take(stage)
    assert stage.do(Handling.LOOK, BOX).failure is HandlingFailure.FULL
    assert stage.do(Handling.PICK).state is TaskState.SUCCEEDED
    assert stage.do(Handling.PICK, "other").failure is HandlingFailure.FULL


def test_an_empty_hand_puts_nothing_down(stage: Stage) -> None:
    status = stage.do(Handling.PLACE, at=beside(stage))
    assert (status.failure, status.holding) == (HandlingFailure.NOT_HELD, "")


def test_a_box_is_too_big_to_be_taken(stage: Stage) -> None:
    status = stage.do(Handling.PICK, "other")
    assert status.failure is HandlingFailure.TOO_BIG
    assert "the gripper takes up to" in status.reason


def test_the_same_seed_makes_the_same_motions() -> None:
    once, again = Stage(3), Stage(3)
    for one in (once, again):
        take(one)
    assert once.statuses == again.statuses
    np.testing.assert_array_equal(once.driver.arm_joints, again.driver.arm_joints)
    assert once.world.world_from_start == Pose2(0.0, 0.0, 0.0)
    once.close()
    again.close()
