"""What an instruction has the arm do, as others see it on the topics."""

import math
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from schemas import topics
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from schemas.language import Annotations, BehaviorSymbol
from schemas.motion import StopLatch
from schemas.run import RunConfig
from schemas.sensing import Odometry
from schemas.task import (
    CancelRequest,
    Failure,
    Goal,
    GoalStatus,
    Handling,
    HandlingFailure,
    HandlingGoal,
    HandlingStatus,
    InstructionStatus,
    TaskState,
)
from services.policy.node import PolicyNode

SECOND = 1_000_000_000
BOX, BALL, HIDDEN = 1, 2, 1000
BOX_AT = (3.0, 0.0)
STANDING = Pose2(2.05, 0.0, 0.0)
"""Before the box, within reach of it."""
START = Pose2(0.0, 0.0, 0.0)


def words(action: str = "retrieve", name: str = "i") -> Annotations:
    behavior = BehaviorSymbol(
        probability=1.0, action=action, object="ball", mode="unknown", relation="inside",
        landmark="box",
    )  # fmt: skip
    return Annotations(
        stamp_ns=SECOND, instruction_id=name, text="", understood=True, parse="",
        parse_probability=1.0, annotations=(), behaviors=(behavior,), unknown_words=(),
        question=None, possible=(),
    )  # fmt: skip


def belief(stamp_ns: int, base: Pose2, ball_seen: bool, name: str = "i") -> MapBelief:
    """Ten particles with the ball in the one box that was seen; it was seen itself, or was not."""
    at_ball = (BOX_AT[0] + 0.05, BOX_AT[1])
    rows = [(-1, BOX, 1, BOX_AT, 0.36)]
    owners = [(-1, BALL)] if ball_seen else [(particle, HIDDEN) for particle in range(10)]
    rows += [(*owner, 0, at_ball, 0.1) for owner in owners]
    count = len(rows)
    return MapBelief(
        stamp_ns=stamp_ns,
        instruction_id=name,
        classes=("ball", "box"),
        weights=np.full(10, 0.1),
        particle=np.array([row[0] for row in rows], np.int32),
        node=np.array([row[1] for row in rows], np.int32),
        class_index=np.array([row[2] for row in rows], np.int32),
        class_probability=np.ones(count),
        position=np.array([row[3] for row in rows], float),
        covariance=np.zeros((count, 2, 2)),
        extent=np.array([[row[4]] * 3 for row in rows]),
        existence=np.full(count, 0.95),
        figure=np.full(10, BALL if ball_seen else HIDDEN, np.int32),
        landmark=np.full(10, BOX, np.int32),
        figure_class=np.zeros(10, np.int32),
        landmark_class=np.ones(10, np.int32),
        topology=np.zeros(10, np.int32),
        node_regions=np.zeros((0, 0), np.int32),
        region_edges=np.zeros((0, 3), np.int32),
        viewer=START,
        map_from_odom=START,
        map_from_base=base,
        trajectory=np.zeros((1, 3)),
        effective_particles=10.0,
    )


GRID = OccupancyGrid(
    stamp_ns=1,
    origin=(-10.0, -10.0),
    resolution=0.2,
    occupancy=np.full((100, 100), -20, np.int8),
    looked=np.full((100, 100), -30, np.int8),
)


class Robot:
    """The policy's process, and what it asked for last."""

    def __init__(self, action: str = "retrieve") -> None:
        self.node = PolicyNode(RunConfig(robot="husky_ur5"), np.random.default_rng(0))
        self.asked: dict[str, list[Any]] = {}
        self.stamp_ns, self.base = SECOND, START
        self.tell(topics.GRID, GRID)
        self.stand(START)
        self.tell(topics.ANNOTATIONS, words(action))

    def tell(self, topic, message) -> None:
        for output in self.node.handlers()[topic](message):
            self.asked.setdefault(output.topic.key, []).append(output.message)

    def stand(self, base: Pose2) -> None:
        self.base = base
        odometry = Odometry(
            stamp_ns=self.stamp_ns, odom_from_base=base, linear=0.0, angular=0.0,
            variance_per_metre=0.0, variance_per_radian=0.0,
        )  # fmt: skip
        self.tell(topics.ODOMETRY, odometry)

    def believe(self, ball_seen: bool = False, seconds: float = 4.0, name: str = "i") -> None:
        for _ in range(round(seconds * 2)):
            self.stamp_ns += SECOND // 2
            self.tell(topics.BELIEF, belief(self.stamp_ns, self.base, ball_seen, name))

    def arrive(self, base: Pose2, state: TaskState = TaskState.SUCCEEDED) -> None:
        self.stand(base)
        status = GoalStatus(
            stamp_ns=self.stamp_ns, goal_id=self.goal.id, state=state, reason="so it is",
            path=np.zeros((0, 2)),
        )  # fmt: skip
        self.tell(topics.GOAL_STATUS, status)

    def arm(
        self,
        state: TaskState = TaskState.SUCCEEDED,
        holding: str = "",
        failure: HandlingFailure | None = None,
    ) -> None:
        status = HandlingStatus(
            stamp_ns=self.stamp_ns, goal_id=self.handling.id, state=state, failure=failure,
            reason="so it is", holding=holding,
        )  # fmt: skip
        self.tell(topics.HANDLING_STATUS, status)

    def stop(self, stopped: bool) -> None:
        latch = StopLatch(stamp_ns=self.stamp_ns, stopped=stopped, source="test")
        self.tell(topics.STOP, latch)

    @property
    def goal(self) -> Goal:
        return self.asked[topics.GOAL.key][-1]

    @property
    def handling(self) -> HandlingGoal:
        return self.asked[topics.HANDLING_GOAL.key][-1]

    @property
    def actions(self) -> list[Handling]:
        return [goal.action for goal in self.asked.get(topics.HANDLING_GOAL.key, [])]

    @property
    def status(self) -> InstructionStatus:
        return self.asked[topics.INSTRUCTION_STATUS.key][-1]

    def look(self) -> None:
        """Come to the box and look into it."""
        self.believe()
        self.arrive(STANDING)
        self.arm()

    def take(self) -> None:
        """Look, see the ball, and take it."""
        self.look()
        self.believe(ball_seen=True)
        assert self.handling.action is Handling.PICK
        self.arm(holding="ball")


def test_a_box_that_may_hold_it_is_driven_to_and_looked_into() -> None:
    robot = Robot()
    robot.believe()
    decision = robot.asked[topics.DECISION.key][-1]
    assert decision.kinds[decision.chosen] == "inside"
    pose = robot.goal.map_from_goal
    away = math.hypot(pose.x - BOX_AT[0], pose.y - BOX_AT[1])
    assert 0.85 < away < 1.1
    assert robot.actions == []
    robot.arrive(STANDING)
    assert robot.actions == [Handling.LOOK]
    assert robot.handling.label == "box"
    np.testing.assert_allclose(robot.handling.map_from_thing.position[:2], BOX_AT)


def test_from_too_far_away_nobody_looks() -> None:
    robot = Robot()
    robot.believe()
    robot.arrive(Pose2(1.0, 0.0, 0.0))
    assert robot.actions == []


def test_nothing_is_decided_while_the_arm_works() -> None:
    robot = Robot()
    robot.believe()
    robot.arrive(STANDING)
    before = len(robot.asked[topics.DECISION.key])
    robot.believe(seconds=10.0)
    assert len(robot.asked[topics.DECISION.key]) == before


def test_a_base_that_passes_the_thing_stands_still_before_the_arm_moves() -> None:
    robot = Robot()
    robot.believe()
    driven = len(robot.asked[topics.GOAL.key])
    robot.stand(STANDING)
    robot.believe(ball_seen=True)
    assert robot.actions == []
    assert len(robot.asked[topics.GOAL.key]) == driven + 1
    assert robot.goal.map_from_goal == STANDING
    robot.arrive(STANDING)
    robot.believe(ball_seen=True)
    assert robot.actions == [Handling.PICK]


def test_what_was_found_is_taken_carried_home_and_held_there() -> None:
    robot = Robot()
    robot.take()
    assert robot.actions == [Handling.LOOK, Handling.PICK, Handling.STOW]
    driven = len(robot.asked[topics.GOAL.key])
    robot.arm(holding="ball")
    assert len(robot.asked[topics.GOAL.key]) == driven + 1
    assert robot.goal.map_from_goal == START
    assert robot.status.state is TaskState.ACTIVE
    robot.arrive(START)
    assert robot.status.state is TaskState.SUCCEEDED
    assert robot.status.reason == "the ball was brought to where it was asked for"


def test_what_is_only_to_be_picked_up_is_not_brought() -> None:
    robot = Robot("pick")
    robot.take()
    robot.arm(holding="ball")
    assert robot.status.state is TaskState.SUCCEEDED
    assert robot.status.reason == "the ball is in the gripper"
    assert "home" not in robot.goal.id


def test_where_one_only_goes_the_arm_is_folded_at_the_end() -> None:
    robot = Robot("navigate")
    robot.look()
    robot.believe(ball_seen=True)
    assert robot.actions == [Handling.LOOK, Handling.STOW]
    assert robot.status.state is TaskState.ACTIVE
    robot.arm()
    assert (robot.status.state, robot.status.reason) == (TaskState.SUCCEEDED, "goal confirmed")


def test_the_arm_is_folded_before_the_base_drives_on() -> None:
    robot = Robot()
    robot.look()
    driven = len(robot.asked[topics.GOAL.key])
    # Nothing was found, and the box is not believed to hold it any more: it is looked for.
    for _ in range(4):
        robot.stamp_ns += SECOND
        elsewhere = belief(robot.stamp_ns, robot.base, ball_seen=False)
        moved = elsewhere.position.copy()
        moved[1:] = (-2.0, 3.0)
        nowhere = np.full(10, -1, np.int32)
        robot.tell(topics.BELIEF, replace(elsewhere, position=moved, landmark=nowhere))
    assert robot.actions == [Handling.LOOK, Handling.STOW]
    assert len(robot.asked[topics.GOAL.key]) == driven
    robot.arm()
    assert len(robot.asked[topics.GOAL.key]) == driven + 1


@pytest.mark.parametrize(
    ("failure", "end"),
    [
        (HandlingFailure.TOO_BIG, Failure.GRASP_FAILED),
        (HandlingFailure.STUCK, Failure.FAULT),
        (HandlingFailure.BLIND, Failure.FAULT),
    ],
)
def test_some_failures_of_the_arm_end_the_instruction(
    failure: HandlingFailure, end: Failure
) -> None:
    robot = Robot()
    robot.look()
    robot.believe(ball_seen=True)
    robot.arm(TaskState.FAILED, failure=failure)
    assert (robot.status.state, robot.status.failure) == (TaskState.FAILED, end)
    assert robot.status.reason == "so it is"
    # What was broken off leaves the arm out: it is to come back.
    assert robot.actions[-1] is Handling.STOW


def test_what_slipped_is_tried_again_but_not_for_ever() -> None:
    robot = Robot()
    robot.look()
    robot.believe(ball_seen=True)
    for _ in range(3):
        robot.arm(TaskState.FAILED, failure=HandlingFailure.NOT_HELD)
        assert robot.status.state is TaskState.ACTIVE
        robot.believe(ball_seen=True)
        assert robot.handling.action is Handling.PICK
    robot.arm(TaskState.FAILED, failure=HandlingFailure.NOT_HELD)
    assert robot.status.failure is Failure.GRASP_FAILED


def test_what_is_out_of_reach_is_tried_from_elsewhere() -> None:
    robot = Robot()
    robot.look()
    robot.believe(ball_seen=True)
    robot.arm(TaskState.FAILED, failure=HandlingFailure.UNREACHABLE)
    robot.believe(ball_seen=True)
    assert robot.handling.action is Handling.STOW
    robot.arm()
    pose = robot.goal.map_from_goal
    assert math.hypot(pose.x - STANDING.x, pose.y - STANDING.y) > 0.5
    assert 0.85 < math.hypot(pose.x - BOX_AT[0], pose.y - BOX_AT[1]) < 1.1


def test_what_falls_on_the_way_home_is_looked_for_again() -> None:
    robot = Robot()
    robot.take()
    robot.arm(holding="ball")
    robot.stand(Pose2(1.0, 0.0, math.pi))
    robot.arm(TaskState.FAILED, failure=HandlingFailure.DROPPED)
    robot.believe(ball_seen=True)
    assert robot.status.state is TaskState.ACTIVE
    assert "home" not in robot.goal.id


def test_after_a_stop_in_the_carry_the_arm_is_asked_again() -> None:
    robot = Robot()
    robot.take()
    robot.stop(True)
    robot.arm(TaskState.CANCELLED, holding="ball")
    robot.believe(ball_seen=True)
    assert robot.actions.count(Handling.STOW) == 1
    robot.stop(False)
    robot.believe(ball_seen=True)
    assert robot.actions.count(Handling.STOW) == 2
    robot.arm(holding="ball")
    assert robot.goal.map_from_goal == START


def test_a_way_home_that_is_blocked_is_tried_again_and_then_said() -> None:
    robot = Robot()
    robot.take()
    robot.arm(holding="ball")
    ids = set()
    for _ in range(3):
        ids.add(robot.goal.id)
        robot.arrive(STANDING, TaskState.FAILED)
    assert len(ids) == 3
    assert robot.status.failure is Failure.PLANNER_FAILED
    assert "the ball is held" in robot.status.reason


def test_a_full_hand_is_freed_before_another_thing_is_looked_for() -> None:
    robot = Robot()
    held = HandlingStatus(
        stamp_ns=0, goal_id="before", state=TaskState.SUCCEEDED, failure=None, reason="",
        holding="cracker box",
    )  # fmt: skip
    robot.tell(topics.HANDLING_STATUS, held)
    robot.believe()
    assert robot.actions == [Handling.PLACE]
    assert robot.handling.label == "cracker box"
    assert topics.GOAL.key not in robot.asked
    robot.arm()
    robot.believe()
    assert robot.actions == [Handling.PLACE, Handling.STOW]


def test_a_cancelled_instruction_folds_the_arm() -> None:
    robot = Robot()
    robot.believe()
    robot.arrive(STANDING)
    robot.tell(topics.CANCEL, CancelRequest(stamp_ns=robot.stamp_ns, source="test"))
    assert robot.status.state is TaskState.CANCELLED
    assert robot.actions == [Handling.LOOK, Handling.STOW]


def test_no_two_goals_of_the_arm_have_one_id() -> None:
    robot = Robot()
    robot.take()
    ids = [goal.id for goal in robot.asked[topics.HANDLING_GOAL.key]]
    assert len(set(ids)) == len(ids)
