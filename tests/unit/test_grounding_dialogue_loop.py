"""The conversation in lockstep: real grounding, mapping and policy, a robot that stands still."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from schemas import topics
from schemas.codec import decode
from schemas.geometry import Pose2
from schemas.health import Tick
from schemas.language import Annotations, Answer, Instruction
from schemas.run import RunConfig
from schemas.sensing import LaserScan
from schemas.task import CancelRequest, Failure, InstructionStatus, TaskState
from schemas.topics import Handlers, Output
from services.grounding.dialogue import PATIENCE_S
from services.grounding.node import GroundingNode
from services.policy.errand import answer_limit_s
from services.policy.node import PolicyNode
from services.process_table import Process, process_named
from services.runtime.lockstep import Lockstep
from services.runtime.mailbox import Sample
from services.runtime.worker import build_node
from tests.unit.test_mapping_episode import World

SECOND = 1_000_000_000
ROBOT = Process(name="robot", node="", latency_ms=0.0, listens=(topics.TICK,), tick_hz=2.0)
ACTIVE, FAILED, SUCCEEDED = TaskState.ACTIVE, TaskState.FAILED, TaskState.SUCCEEDED


class StandingRobot:
    """Sees the toy world from where it stands; nothing is in its way."""

    def __init__(self, world: World) -> None:
        self._world = world

    def handlers(self) -> Handlers:
        return {topics.TICK: self.on_tick}

    def on_tick(self, tick: Tick) -> Iterable[Output]:
        self._world.time_ns = tick.stamp_ns
        yield topics.ODOMETRY.of(self._world.odometry())
        yield topics.DETECTIONS.of(self._world.look())
        yield topics.SCAN.of(
            LaserScan(
                stamp_ns=tick.stamp_ns,
                angle_min=-np.pi,
                angle_increment=2 * np.pi / 60,
                range_max=15.0,
                ranges=np.full(60, 15.0, np.float32),
                base_from_laser=Pose2(0.0, 0.0, 0.0),
                odom_from_base=self._world.odom,
            )
        )


class Loop:
    """The system without a base, and what went over its topics."""

    def __init__(self, *things: tuple[str, float, float]) -> None:
        run = RunConfig(particles=30)
        members: dict[Process, Any] = {
            process_named(name): build_node(process_named(name), run)
            for name in ("grounding", "mapping", "policy")
        }
        members[ROBOT] = StandingRobot(World(list(things), false_rate=0.0))
        self.statuses: list[InstructionStatus] = []
        self.annotations: list[Annotations] = []
        self.goals: list[str] = []
        self._lockstep = Lockstep(members, on_message=self._note)
        self._number = 0
        self.run(1.0)

    def run(self, seconds: float) -> None:
        until_ns = self._lockstep.now_ns + round(seconds * SECOND)
        self._lockstep.run(until_ns)
        self._lockstep.now_ns = until_ns

    def say(self, text: str, seconds: float = 2.0) -> str:
        self._number += 1
        name = f"i{self._number}"
        now = self._lockstep.now_ns
        said = Instruction(stamp_ns=now, id=name, text=text, source="test")
        self._lockstep.send(topics.INSTRUCTION.of(said))
        self.run(seconds)
        return name

    def answer(self, text: str, seconds: float = 2.0) -> None:
        now = self._lockstep.now_ns
        answer = Answer(stamp_ns=now, instruction_id="", text=text, source="test")
        self._lockstep.send(topics.ANSWER.of(answer))
        self.run(seconds)

    def cancel(self) -> None:
        request = CancelRequest(stamp_ns=self._lockstep.now_ns, source="test")
        self._lockstep.send(topics.CANCEL.of(request))
        self.run(1.0)

    def last(self, name: str) -> InstructionStatus:
        return [one for one in self.statuses if one.instruction_id == name][-1]

    def meaning(self, name: str) -> Annotations:
        return [one for one in self.annotations if one.instruction_id == name][-1]

    def _note(self, publisher: str, stamp_ns: int, sample: Sample) -> None:
        del publisher, stamp_ns
        if sample.topic is topics.INSTRUCTION_STATUS:
            self.statuses.append(decode(sample.payload, InstructionStatus))
        elif sample.topic is topics.ANNOTATIONS:
            self.annotations.append(decode(sample.payload, Annotations))
        elif sample.topic is topics.BELIEF:
            self.belief = decode(sample.payload, topics.BELIEF.type)
        elif sample.topic is topics.GOAL:
            self.goals.append(decode(sample.payload, topics.GOAL.type).instruction_id)


def test_the_robot_stays_until_the_answer_and_then_goes() -> None:
    loop = Loop()
    name = loop.say("go to the gizmo", 10.0)
    assert loop.last(name).state is ACTIVE
    assert loop.last(name).reason.startswith("waiting for an answer: By")
    assert loop.goals == []
    loop.answer("a cone")
    assert loop.meaning(name).understood
    assert loop.meaning(name).revision == 1
    assert loop.last(name).state is ACTIVE
    assert set(loop.goals) == {name}


def test_without_an_answer_it_ends_as_not_understood() -> None:
    loop = Loop()
    name = loop.say("go to the gizmo", answer_limit_s - 2.0)
    assert loop.last(name).state is ACTIVE
    loop.run(4.0)
    assert (loop.last(name).state, loop.last(name).failure) == (FAILED, Failure.NOT_UNDERSTOOD)
    assert loop.goals == []
    loop.answer("a cone")
    assert loop.last(name).state is FAILED


def test_what_is_hopeless_ends_at_once() -> None:
    loop = Loop()
    name = loop.say("xyzzy")
    assert (loop.last(name).state, loop.last(name).failure) == (FAILED, Failure.NOT_UNDERSTOOD)


def test_while_a_question_is_open_what_runs_goes_on_until_the_answer() -> None:
    loop = Loop()
    first = loop.say("go to the hydrant behind the cone")
    second = loop.say("go to the gizmo", 4.0)
    assert loop.last(second).reason.startswith("waiting")
    assert loop.statuses[-1].instruction_id == first
    loop.answer("a barrel")
    assert loop.last(first).state is TaskState.CANCELLED
    assert loop.last(second).state is ACTIVE
    assert loop.goals[-1] == second


def test_cancel_drops_the_question() -> None:
    loop = Loop()
    name = loop.say("go to the gizmo")
    loop.cancel()
    assert loop.last(name).state is TaskState.CANCELLED
    loop.answer("a cone")
    assert loop.goals == []


@pytest.mark.parametrize(
    "text", ["there is a hydrant behind the cone", "the barrel is near the wall", "a tree"]
)
def test_a_statement_never_moves_the_robot(text: str) -> None:
    loop = Loop(("cone", 5.0, 0.0))
    name = loop.say(text, 5.0)
    assert loop.last(name).state is SUCCEEDED
    assert loop.goals == []


def test_a_statement_does_not_end_what_runs() -> None:
    loop = Loop()
    name = loop.say("go to the hydrant")
    goals = len(loop.goals)
    noted = loop.say("the hydrant is behind the barrel")
    assert loop.last(noted).state is SUCCEEDED
    assert loop.last(name).state is ACTIVE
    assert loop.statuses[-1].instruction_id == name
    best = loop.meaning(name).behaviors[0]
    assert (best.relation, best.landmark) == ("back", "barrel")
    assert len(loop.goals) > goals
    assert set(loop.goals) == {name}


def test_a_correction_gives_what_runs_another_goal() -> None:
    loop = Loop()
    name = loop.say("go to the hydrant behind the cone")
    correction = loop.say("no, the one behind the tree")
    assert loop.last(correction).state is SUCCEEDED
    assert loop.last(name).state is ACTIVE
    assert loop.last(name).text == "go to the hydrant behind the tree"
    best = loop.meaning(name).behaviors[0]
    assert (best.object, best.relation, best.landmark) == ("hydrant", "back", "tree")
    assert set(loop.goals) == {name}


def test_where_it_is_is_asked_on_the_way_and_never_stops_the_robot() -> None:
    loop = Loop()
    name = loop.say("go to the hydrant", PATIENCE_S + 3.0)
    assert loop.meaning(name).question == "Where is the hydrant?"
    assert loop.meaning(name).understood
    assert loop.last(name).state is ACTIVE
    before = len(loop.annotations)
    loop.run(5.0)
    assert len(loop.annotations) == before
    loop.answer("near the wall")
    best = loop.meaning(name).behaviors[0]
    assert (best.relation, best.landmark) == ("near", "wall")
    assert loop.meaning(name).question is None
    assert loop.last(name).state is ACTIVE


def test_a_killed_policy_still_waits_and_the_answer_starts_it() -> None:
    loop = Loop()
    name = loop.say("go to the gizmo")
    heir = PolicyNode(RunConfig(), np.random.default_rng(0))
    assert not list(heir.resume()[topics.INSTRUCTION_STATUS](loop.last(name)))
    waits = [one.message for one in heir.on_annotations(loop.meaning(name))]
    assert [one.state for one in waits if isinstance(one, InstructionStatus)] == [ACTIVE]
    loop.answer("a cone")
    goes = [one.message for one in heir.on_annotations(loop.meaning(name))]
    assert [one.reason for one in goes if isinstance(one, InstructionStatus)] == ["understood"]


def test_a_killed_grounding_takes_an_answer_to_a_question_that_it_did_not_ask_itself() -> None:
    loop = Loop()
    name = loop.say("go to the gizmo")
    heir = GroundingNode(RunConfig(), np.random.default_rng(0))
    assert not list(heir.resume()[topics.ANNOTATIONS](loop.meaning(name)))
    answer = Answer(stamp_ns=9, instruction_id=name, text="a cone", source="test")
    (output,) = heir.on_answer(answer)
    assert isinstance(output.message, Annotations)
    assert (output.message.understood, output.message.revision) == (True, 1)


def test_a_killed_grounding_goes_on_with_what_runs_while_another_question_is_open() -> None:
    loop = Loop()
    first = loop.say("go to the hydrant behind the cone")
    second = loop.say("go to the gizmo")
    heir = GroundingNode(RunConfig(), np.random.default_rng(0))
    heir.resume()[topics.ANNOTATIONS](loop.meaning(second))
    outputs = list(heir.on_belief(loop.belief))
    assert [one.message.instruction_id for one in outputs] == [first]  # type: ignore[attr-defined]
