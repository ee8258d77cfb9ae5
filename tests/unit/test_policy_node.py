"""The life of instructions, as others see it on the topics."""

import numpy as np
import pytest

from schemas import topics
from schemas.belief import MapBelief, OccupancyGrid
from schemas.codec import decode, encode
from schemas.geometry import Pose2
from schemas.language import Annotations, BehaviorSymbol
from schemas.motion import StopLatch
from schemas.run import RunConfig
from schemas.sensing import Odometry
from schemas.task import CancelRequest, Failure, Goal, GoalStatus, InstructionStatus, TaskState
from services.policy import places
from services.policy.errand import time_limit_s
from services.policy.node import PolicyNode

SECOND = 1_000_000_000
GO = BehaviorSymbol(
    probability=1.0,
    action="navigate",
    object="hydrant",
    mode="unknown",
    relation="unknown",
    landmark="unknown",
)


def annotations(name="i", understood=True, behaviors=(GO,), unknown=()) -> Annotations:
    return Annotations(
        stamp_ns=SECOND,
        instruction_id=name,
        text="go to the hydrant",
        understood=understood,
        parse="",
        parse_probability=1.0,
        annotations=(),
        behaviors=behaviors,
        unknown_words=unknown,
        question=None,
        possible=(),
    )


def belief(stamp_ns: int, figure: tuple[float, float], seen: bool, name: str = "i") -> MapBelief:
    """Ten particles that agree on one hydrant."""
    particles = np.array([-1] if seen else range(10), np.int32)
    count = len(particles)
    node = 1 if seen else 1000
    here = Pose2(0.0, 0.0, 0.0)
    return MapBelief(
        stamp_ns=stamp_ns,
        instruction_id=name,
        classes=("hydrant",),
        weights=np.full(10, 0.1),
        particle=particles,
        node=np.full(count, node, np.int32),
        class_index=np.zeros(count, np.int32),
        class_probability=np.ones(count),
        position=np.tile(figure, (count, 1)).astype(float),
        covariance=np.zeros((count, 2, 2)),
        extent=np.full((count, 3), 0.4),
        existence=np.full(count, 0.95),
        figure=np.full(10, node, np.int32),
        landmark=np.full(10, -1, np.int32),
        figure_class=np.full(10, -1, np.int32),
        landmark_class=np.full(10, -1, np.int32),
        topology=np.zeros(10, np.int32),
        node_regions=np.zeros((0, 0), np.int32),
        region_edges=np.zeros((0, 3), np.int32),
        viewer=here,
        map_from_odom=here,
        map_from_base=here,
        trajectory=np.zeros((0, 3)),
        effective_particles=10.0,
    )


class Rig:
    """A policy node, and everything that it said."""

    def __init__(self) -> None:
        self.node = PolicyNode(RunConfig(), np.random.default_rng(0))
        self.said = []
        self.pose = Pose2(0.0, 0.0, 0.0)
        self.stamp_ns = SECOND
        self.send(topics.GRID, _free_grid())

    def send(self, topic, message):
        outputs = list(self.node.handlers()[topic](message))
        for output in outputs:  # Whatever is said must survive the wire.
            decode(encode(output.message), output.topic.type)
        self.said += outputs
        return [output.message for output in outputs]

    def believe(self, figure=(8.0, 0.0), seen=False, name="i", seconds=1.0):
        self.stamp_ns += int(seconds * SECOND)
        self.send(
            topics.ODOMETRY,
            Odometry(
                stamp_ns=self.stamp_ns,
                odom_from_base=self.pose,
                linear=0.0,
                angular=0.0,
                variance_per_metre=0.0,
                variance_per_radian=0.0,
            ),
        )
        return self.send(topics.BELIEF, belief(self.stamp_ns, figure, seen, name))

    def all(self, kind):
        return [output.message for output in self.said if isinstance(output.message, kind)]

    def end_goal(self, state: TaskState):
        goal = self.all(Goal)[-1]
        status = GoalStatus(
            stamp_ns=self.stamp_ns,
            goal_id=goal.id,
            state=state,
            reason="",
            path=np.zeros((0, 2)),
        )
        self.send(topics.GOAL_STATUS, status)


def _free_grid() -> OccupancyGrid:
    return OccupancyGrid(
        stamp_ns=1,
        origin=(-15.0, -15.0),
        resolution=0.2,
        occupancy=np.full((150, 150), -20, np.int8),
        looked=np.zeros((150, 150), np.int8),
    )


@pytest.fixture
def rig() -> Rig:
    return Rig()


@pytest.fixture
def busy(rig) -> Rig:
    rig.send(topics.ANNOTATIONS, annotations())
    rig.believe()
    return rig


def test_what_is_not_understood_fails_and_moves_nothing(rig):
    rig.send(topics.ANNOTATIONS, annotations(understood=False, behaviors=(), unknown=("paint",)))
    for _ in range(5):
        rig.believe()
    (status,) = rig.all(InstructionStatus)
    assert status.failure is Failure.NOT_UNDERSTOOD
    assert "paint" in status.reason
    assert not rig.all(Goal)


def test_a_statement_is_noted_and_moves_nothing(rig):
    rig.send(topics.ANNOTATIONS, annotations(behaviors=()))
    for _ in range(5):
        rig.believe()
    (status,) = rig.all(InstructionStatus)
    assert (status.state, status.reason) == (TaskState.SUCCEEDED, "noted")
    assert not rig.all(Goal)


def test_an_instruction_starts_and_sends_one_goal(busy):
    assert busy.all(InstructionStatus)[0].state is TaskState.ACTIVE
    assert len(busy.all(Goal)) == 1
    for _ in range(5):
        busy.believe(seconds=0.2)
    assert len(busy.all(Goal)) == 1


def test_the_same_annotations_again_change_nothing(busy):
    assert busy.send(topics.ANNOTATIONS, annotations()) == []


def test_nothing_is_decided_before_the_utterance_is_evidence(rig):
    rig.send(topics.ANNOTATIONS, annotations())
    rig.believe(name="", seconds=0.5)
    assert not rig.all(Goal)
    rig.believe(seconds=0.5)
    assert len(rig.all(Goal)) == 1


def test_seen_approached_and_confirmed(busy):
    busy.believe(figure=(6.0, 0.0), seen=True)
    goal = busy.all(Goal)[-1].map_from_goal
    assert goal.x == pytest.approx(5.8 - places.stand_off, abs=0.1)
    busy.pose = goal
    busy.end_goal(TaskState.SUCCEEDED)
    busy.believe(figure=(6.0, 0.0), seen=True)
    status = busy.all(InstructionStatus)[-1]
    assert (status.state, status.reason) == (TaskState.SUCCEEDED, "goal confirmed")
    decisions = len(busy.said)
    busy.send(topics.ANNOTATIONS, annotations())
    busy.believe(figure=(6.0, 0.0), seen=True)
    assert len(busy.said) == decisions


def test_cancel_ends_the_instruction_and_halts(busy):
    said = busy.send(topics.CANCEL, CancelRequest(stamp_ns=busy.stamp_ns, source="cli"))
    assert isinstance(said[0], Goal)
    assert said[0].map_from_goal == busy.pose
    assert said[1].state is TaskState.CANCELLED
    assert busy.send(topics.CANCEL, CancelRequest(stamp_ns=busy.stamp_ns, source="cli")) == []


def test_stop_holds_back_goals_and_release_sends_one(busy):
    busy.send(topics.STOP, StopLatch(stamp_ns=busy.stamp_ns, stopped=True, source="web"))
    busy.end_goal(TaskState.SUCCEEDED)
    for _ in range(3):
        assert busy.believe() == []
    busy.send(topics.STOP, StopLatch(stamp_ns=busy.stamp_ns, stopped=False, source="web"))
    busy.believe()
    assert len(busy.all(Goal)) == 2
    assert len({goal.id for goal in busy.all(Goal)}) == 2


def test_time_runs_out_but_not_while_stopped(busy):
    busy.send(topics.STOP, StopLatch(stamp_ns=busy.stamp_ns, stopped=True, source="web"))
    busy.stamp_ns += 2 * int(time_limit_s * SECOND)
    busy.send(topics.STOP, StopLatch(stamp_ns=busy.stamp_ns, stopped=False, source="web"))
    busy.believe()
    assert busy.all(InstructionStatus)[-1].state is TaskState.ACTIVE
    busy.believe(seconds=time_limit_s)
    assert busy.all(InstructionStatus)[-1].failure is Failure.TIMEOUT


def test_goals_that_fail_one_after_the_other_end_the_instruction(busy):
    for _ in range(20):
        if busy.all(InstructionStatus)[-1].state is TaskState.ACTIVE:
            busy.end_goal(TaskState.FAILED)
            busy.believe()
    assert busy.all(InstructionStatus)[-1].failure is Failure.PLANNER_FAILED


def test_a_newer_instruction_replaces_the_old_one(busy):
    busy.send(topics.ANNOTATIONS, annotations("j"))
    states = [(s.instruction_id, s.state) for s in busy.all(InstructionStatus)[-2:]]
    assert states == [("i", TaskState.CANCELLED), ("j", TaskState.ACTIVE)]


def test_a_remark_does_not_end_what_is_being_done(busy):
    busy.send(topics.ANNOTATIONS, annotations("j", behaviors=()))
    assert busy.all(InstructionStatus)[-1].instruction_id == "i"
    busy.end_goal(TaskState.SUCCEEDED)
    busy.believe()
    busy.believe()
    assert len(busy.all(Goal)) == 2


def restarted(old: Rig) -> Rig:
    new = Rig()
    new.node.resume()[topics.INSTRUCTION_STATUS](old.all(InstructionStatus)[-1])
    new.stamp_ns = old.stamp_ns
    return new


def test_a_restarted_policy_goes_on(busy):
    new = restarted(busy)
    new.send(topics.ANNOTATIONS, annotations())
    new.believe()
    (goal,) = new.all(Goal)
    assert goal.instruction_id == "i"
    assert goal.id not in {old.id for old in busy.all(Goal)}


def test_a_restarted_policy_does_not_start_over(busy):
    busy.send(topics.CANCEL, CancelRequest(stamp_ns=busy.stamp_ns, source="cli"))
    new = restarted(busy)
    new.send(topics.ANNOTATIONS, annotations())
    new.believe()
    assert not new.said
