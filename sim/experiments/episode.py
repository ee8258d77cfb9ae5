"""One instruction in one world, in lockstep, from the first word to the truth about its end."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from msgspec import Struct

from schemas import topics
from schemas.belief import shared
from schemas.codec import decode
from schemas.geometry import Pose2
from schemas.language import Annotations, Instruction
from schemas.run import RunConfig
from schemas.sensing import Odometry
from schemas.task import Failure, InstructionStatus, TaskState
from services.policy.node import PolicyNode
from services.policy.policy import BeliefPolicy
from services.process_table import Process
from services.recorder.run_log import RunLog
from services.runtime.lockstep import Lockstep
from services.runtime.mailbox import Sample
from services.runtime.node import Node, node_generator
from services.runtime.stopwatch import Stopwatch
from services.runtime.trace import Trace
from sim.experiments.arms import Arm, Truthful, nodes_of
from sim.experiments.assembly import modelled_assembly, table_assembly
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.simulated_user import USER, SimulatedUser
from sim.experiments.truth import REACHED_M, Truth
from sim.node import DRAWN

SECOND_NS = 1_000_000_000
SAID_AT_NS = SECOND_NS
"""The person speaks after the sensors have been read a few times."""
TIMEOUT_S = 300.0
SETTLE_NS = SECOND_NS
"""How long the base gets to stand still after the instruction ended."""

Progress = Callable[[float, InstructionStatus | None], None]
"""Called with (simulated seconds, status) about once a simulated second."""


class EpisodeResult(Struct, frozen=True, kw_only=True):
    """What `episode --json` prints (contract)."""

    success: bool
    stopped: bool
    reason: str
    distance_m: float
    shortest_path_m: float
    time_s: float
    final_error_m: float
    decisions: int
    failure: Failure | None
    seed: int
    arm: str
    perception_cycles: int
    perception_ms_mean: float
    behavior_inference_ms_per_particle: float
    mapping_ms_mean: float
    objects_detected: int
    log_sha256: str


@dataclass
class _Observer:
    """Collects from the messages what the result needs."""

    instruction_id: str = ""
    status: InstructionStatus | None = None
    annotations: Annotations | None = None
    speed: float = 0.0
    perception_cycles: int = 0
    objects_detected: int = 0
    ended_ns: int = 0
    questions: set[str] = field(default_factory=set[str])

    def note(self, publisher: str, stamp_ns: int, sample: Sample) -> None:
        del publisher
        if sample.topic is topics.INSTRUCTION_STATUS:
            self.status = decode(sample.payload, InstructionStatus)
            self.ended_ns = stamp_ns
        elif sample.topic is topics.ANNOTATIONS:
            self.annotations = decode(sample.payload, Annotations)
            if self.annotations.question is not None:
                self.questions.add(self.annotations.question)
        elif sample.topic is topics.ODOMETRY:
            odometry = decode(sample.payload, Odometry)
            self.speed = max(abs(odometry.linear), abs(odometry.angular))
        elif sample.topic is topics.DETECTIONS:
            self.perception_cycles += 1
        elif sample.topic is topics.BELIEF:
            belief = decode(sample.payload, topics.BELIEF.type)
            self.objects_detected = int(np.sum(belief.particle == shared))

    @property
    def ended(self) -> bool:
        return self.status is not None and self.status.state is not TaskState.ACTIVE


@dataclass(frozen=True)
class Trial:
    """What an experiment makes different from a run of the whole system."""

    arm: Arm = "ours"
    perception: PerceptionSettings | None = None
    """Modelled perception in the place of rendered pictures."""
    intended: tuple[str, ...] = ()
    """Ids of the objects that are meant; by default what the words mean decides."""
    reached_m: float = REACHED_M
    answers: bool = False
    """Whether a simulated person answers the robot's first question."""
    policy: Callable[[Callable[[], Pose2]], BeliefPolicy] | None = None
    """Makes the policy that decides, given the robot's true pose; by default it is the table's."""


class Episode:
    """Builds all nodes of the table, runs them against modelled time, and judges the end."""

    def __init__(
        self, run: RunConfig, text: str, log: Path | None = None, trial: Trial | None = None
    ) -> None:
        self._run, self._text, self._trial = run, text, trial or Trial()
        self._trace, self._observer = Trace(), _Observer()
        self._watch = Stopwatch()
        self._writer = RunLog(log, run) if log else None
        settings = self._trial.perception
        built = modelled_assembly(run, settings) if settings else table_assembly(run)
        self._truth = Truth(built.driver, run, self._trial.intended, self._trial.reached_m)
        truthful = Truthful(lambda: built.driver.world_from_base, self._truth.meant)
        nodes = nodes_of(self._trial.arm, built.nodes, run, truthful)
        if self._trial.policy:
            policy = self._trial.policy(truthful.world_from_base)
            nodes = _with_policy(nodes, PolicyNode(run, node_generator(run, "policy"), policy))
        if self._trial.answers:
            nodes = {**nodes, USER: SimulatedUser(run, self._trial.intended, truthful)}
        timed = {process: self._watch.timed(process.name, node) for process, node in nodes.items()}
        self._lockstep = Lockstep(timed, on_message=self._note)

    @property
    def within_reach(self) -> tuple[str, ...]:
        """Ids of the objects that the robot stands at."""
        return self._truth.within_reach()

    @property
    def questions(self) -> int:
        """How many different questions the robot has asked."""
        return len(self._observer.questions)

    def run(self, progress: Progress) -> EpisodeResult:
        """Run to the end of the instruction, or to the time limit."""
        self._advance(SAID_AT_NS, progress)
        instruction = Instruction(
            stamp_ns=self._lockstep.now_ns, id="episode", text=self._text, source="episode"
        )
        self._lockstep.send(topics.INSTRUCTION.of(instruction))
        self._advance(SAID_AT_NS + round(TIMEOUT_S * SECOND_NS), progress)
        end_ns = self._lockstep.now_ns + SETTLE_NS
        self._lockstep.run(end_ns)
        result = self._result()
        self._close()
        return result

    def _advance(self, until_ns: int, progress: Progress) -> None:
        while self._lockstep.now_ns < until_ns and not self._observer.ended:
            target_ns = min(until_ns, self._lockstep.now_ns + SECOND_NS)
            self._lockstep.run(target_ns, lambda: self._observer.ended)
            self._lockstep.now_ns = max(self._lockstep.now_ns, target_ns)
            progress(self._lockstep.now_ns / 1e9, self._observer.status)

    def _note(self, publisher: str, stamp_ns: int, sample: Sample) -> None:
        self._trace.note(publisher, stamp_ns, sample)
        self._observer.note(publisher, stamp_ns, sample)
        if sample.topic is topics.ODOMETRY:
            self._truth.follow()
        if self._writer is not None:
            self._writer.write(sample, stamp_ns)

    def _result(self) -> EpisodeResult:
        seen, status = self._observer, self._observer.status
        verdict = self._truth.judge(seen.annotations, status)
        times = self._watch.mean_ms
        return EpisodeResult(
            success=verdict.failure is None,
            stopped=seen.speed < 0.01,
            reason=status.reason if status else "no answer",
            distance_m=round(self._truth.distance_m, 3),
            shortest_path_m=round(verdict.shortest_path_m, 3),
            time_s=round((seen.ended_ns - SAID_AT_NS) / 1e9, 3),
            final_error_m=round(verdict.final_error_m, 3),
            decisions=status.decisions if status else 0,
            failure=verdict.failure,
            seed=self._run.seed,
            arm=self._trial.arm,
            perception_cycles=seen.perception_cycles,
            perception_ms_mean=times("perception", topics.RGBD),
            behavior_inference_ms_per_particle=times("grounding", topics.BELIEF)
            / self._run.particles,
            mapping_ms_mean=times("mapping", topics.DETECTIONS),
            objects_detected=seen.objects_detected,
            log_sha256=self._trace.sha256,
        )

    def _close(self) -> None:
        self._lockstep.close()
        if self._writer is not None:
            self._writer.close()


def _with_policy(nodes: Mapping[Process, Node], policy: PolicyNode) -> Mapping[Process, Node]:
    return {row: policy if row.name == "policy" else node for row, node in nodes.items()}


def run_episode(
    run: RunConfig, text: str, log: Path | None, progress: Progress, arm: Arm = "ours"
) -> dict[str, Any]:
    """One episode; returns the contract's document.

    Perception is modelled for robots whose cameras' pictures cannot be drawn.
    """
    perception = None if run.robot in DRAWN else PerceptionSettings()
    result = Episode(run, text, log, Trial(arm=arm, perception=perception)).run(progress)
    return msgspec.to_builtins(result)
