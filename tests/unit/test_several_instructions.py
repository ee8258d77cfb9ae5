"""More than one instruction in a run: the map stays, and the newest instruction counts."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

from schemas import topics
from schemas.belief import MapBelief
from schemas.language import Instruction
from schemas.run import RunConfig
from schemas.task import Decision, InstructionStatus, TaskState
from services.runtime.lockstep import Lockstep, message_of
from services.runtime.mailbox import Sample
from sim.experiments.assembly import modelled_assembly
from sim.experiments.perception_model import ModelledPerception, PerceptionSettings
from sim.world import make_world

SECOND_NS = 1_000_000_000
CARRIED = np.array([0.0, 4.0])
pytestmark = pytest.mark.slow


@dataclass
class Run:
    """All nodes in lockstep in one of the paper's worlds, spoken to as a person would."""

    seed: int
    world: str = "one_hydrant_one_cone"
    beliefs: list[MapBelief] = field(default_factory=list)
    statuses: list[InstructionStatus] = field(default_factory=list)
    decisions: list[Decision] = field(default_factory=list)
    faults: list[object] = field(default_factory=list)

    def __post_init__(self) -> None:
        run = RunConfig(
            world=self.world, seed=self.seed, view_range_m=5.0, view_fov_rad=2 * math.pi
        )
        self.true = make_world(run.world, run.seed)
        self.built = modelled_assembly(run, PerceptionSettings())
        self.lockstep = Lockstep(self.built.nodes, on_message=self._note)
        self.lockstep.run(SECOND_NS)

    def say(self, text: str, name: str) -> None:
        instruction = Instruction(
            stamp_ns=self.lockstep.now_ns, id=name, text=text, source="person"
        )
        self.lockstep.send(topics.INSTRUCTION.of(instruction))

    def until(self, done: Callable[[], bool], seconds: float) -> bool:
        self.lockstep.run(self.lockstep.now_ns + round(seconds * SECOND_NS), done)
        return done()

    def ended(self, name: str) -> bool:
        return self.state_of(name) not in (None, TaskState.ACTIVE)

    def state_of(self, name: str) -> TaskState | None:
        states = [status.state for status in self.statuses if status.instruction_id == name]
        return states[-1] if states else None

    def distance_to(self, name: str) -> float:
        """From the robot to the true object [m]."""
        here = self.built.driver.world_from_base
        there = self.true.find(name).world_from_object
        return math.hypot(here.x - there.x, here.y - there.y)

    def _note(self, publisher: str, stamp_ns: int, sample: Sample) -> None:
        del publisher, stamp_ns
        lists: dict[object, list] = {
            topics.BELIEF: self.beliefs,
            topics.INSTRUCTION_STATUS: self.statuses,
            topics.DECISION: self.decisions,
            topics.FAULT: self.faults,
        }
        if sample.topic in lists:
            lists[sample.topic].append(message_of(sample))


def seen_classes(belief: MapBelief) -> set[str]:
    return {belief.classes[index] for index in belief.class_index[belief.seen]}


@pytest.mark.parametrize("seed", [5000, 5001, 5002])
def test_what_the_first_instruction_showed_is_used_by_the_second(seed: int) -> None:
    run = Run(seed)
    run.say("go to the hydrant behind the cone", "first")
    assert run.until(lambda: run.ended("first"), 200)
    assert run.state_of("first") is TaskState.SUCCEEDED
    before = run.beliefs[-1]
    assert seen_classes(before) >= {"cone", "hydrant"}
    started_ns = run.lockstep.now_ns
    run.say("go to the cone", "second")
    assert run.until(lambda: run.ended("second"), 60)
    assert run.state_of("second") is TaskState.SUCCEEDED
    assert run.distance_to("cone_1") < 2.0
    # No search: as soon as its words are grounded in the map, what is known is driven to.
    kinds = [
        one.kinds[one.chosen]
        for one in run.decisions
        if one.instruction_id == "second" and one.stamp_ns > started_ns
    ]
    assert set(kinds) <= {"observed", "stop"}
    assert (run.lockstep.now_ns - started_ns) / 1e9 < 30
    path = run.beliefs[-1].trajectory
    assert len(path) >= len(before.trajectory)
    shift = np.abs(path[: len(before.trajectory), :2] - before.trajectory[:, :2])
    assert shift.max() < 0.5
    assert not run.faults


def test_a_second_instruction_replaces_the_first_while_it_runs() -> None:
    run = Run(5003)
    run.say("go to the hydrant", "first")
    run.until(lambda: False, 4)
    assert run.state_of("first") is TaskState.ACTIVE
    nodes = len(run.beliefs[-1].trajectory)
    run.say("go to the cone", "second")
    assert run.until(lambda: run.ended("first"), 2)
    assert run.state_of("first") is TaskState.CANCELLED
    assert run.until(lambda: run.ended("second"), 200)
    assert run.state_of("second") is TaskState.SUCCEEDED
    assert run.distance_to("cone_1") < 2.0
    assert len(run.beliefs[-1].trajectory) >= nodes
    late = [one for one in run.decisions if one.instruction_id == "first"]
    assert len(late) < len(run.decisions)
    assert not run.faults


def test_a_goal_that_is_moved_during_the_search_is_found_where_it_is() -> None:
    """The hydrant is carried elsewhere once it was seen, before the robot stands at it."""
    run = Run(5004)
    run.say("go to the hydrant", "first")
    perception = next(
        node for node in run.built.nodes.values() if isinstance(node, ModelledPerception)
    )
    assert run.until(lambda: "hydrant" in seen_classes(run.beliefs[-1]), 200)
    row = [placed.id for placed in run.true.objects].index("hydrant_1")
    moved = perception._positions[row] + CARRIED
    perception._positions[row] = moved
    assert run.until(lambda: run.ended("first"), 200)
    assert run.state_of("first") is TaskState.SUCCEEDED
    here = run.built.driver.world_from_base
    assert math.hypot(here.x - moved[0], here.y - moved[1]) < 2.0
    assert not run.faults
