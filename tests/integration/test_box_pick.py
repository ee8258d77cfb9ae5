"""A ball is taken out of a box by planned motions; what goes wrong is said and nothing thrown."""

import numpy as np
import pytest

pytest.importorskip("sapien")

from robots.husky_ur5.spec import UR5
from schemas.task import HandlingFailure
from sim.experiments.box_pick import THING, BoxPick, run_pick

pytestmark = pytest.mark.slow
SEED = 1


def test_the_ball_is_taken_out_and_held_without_touching_the_box() -> None:
    trial = run_pick(SEED)
    assert trial.failure is None, trial.reason
    assert trial.arm_force < 1.0
    assert trial.slip < 1e-3
    assert trial.time_s < 20.0


def when(moment, act):
    """Something that happens once, at the first step at which `moment` holds."""
    done = []

    def meddle(trial: BoxPick) -> None:
        if not done and moment(trial):
            done.append(True)
            act(trial)

    return meddle


def fingers_at_ball(trial: BoxPick) -> bool:
    return float(np.linalg.norm(trial.thing_in_hand())) < 0.06


def take_ball_away(trial: BoxPick) -> None:
    trial.driver.loose.take_away(THING)


def test_a_ball_that_vanishes_during_the_reach_is_not_held() -> None:
    trial = run_pick(SEED, meddle=when(fingers_at_ball, take_ball_away))
    assert trial.failure is HandlingFailure.NOT_HELD
    assert trial.reason == "the fingers closed on nothing"


def test_a_ball_that_is_lost_on_the_way_is_noticed() -> None:
    trial = run_pick(SEED, meddle=when(lambda trial: trial.lifted, take_ball_away))
    assert trial.failure is HandlingFailure.DROPPED


@pytest.mark.parametrize("joint", [UR5.joints[1], UR5.joints[5]])
def test_a_jammed_joint_is_noticed(joint: str) -> None:
    def jam(trial: BoxPick) -> None:
        trial.driver.jam_joint(joint)

    trial = run_pick(SEED, meddle=when(lambda trial: trial.driver.stamp_ns > 2e9, jam))
    assert trial.failure is HandlingFailure.STUCK


def test_a_stop_in_the_middle_of_a_carry_holds_arm_and_ball() -> None:
    heights = []

    def meddle(trial: BoxPick) -> None:
        if trial.lifted:
            trial.driver.latch_stop(True)
            heights.append(trial.driver.loose.poses[THING].position[2])

    trial = run_pick(SEED, meddle=meddle)
    assert trial.failure is HandlingFailure.STUCK
    assert heights[-1] == pytest.approx(heights[100], abs=2e-3)
