"""One instruction from its start to its end, in the policy's own terms."""

import math
from dataclasses import dataclass, field

import numpy as np

from schemas.arrays import Floats
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from schemas.language import Annotations
from schemas.task import Failure, Goal, GoalStatus, TaskState
from services.policy.cost import words_of
from services.policy.pacing import Pace, hidden_mass, seen_objects
from services.policy.policy import BeliefPolicy, Choice, Memory
from services.policy.referents import Referents, place_of

time_limit_s = 300.0
"""Of message time, pauses by the stop latch not counted [s]."""

answer_limit_s = 120.0
"""So long an instruction waits for the answer to a question [s]."""

_failures_in_a_row = 6
_idle_in_a_row = 5
"""A grid that is short of a scan may hide all ways for a moment."""
_missed_by = 0.6
"""A goal that ended farther off than this was not really reached [m]."""


@dataclass(frozen=True)
class Ending:
    """How an instruction ended."""

    state: TaskState
    failure: Failure | None
    reason: str


@dataclass
class Errand:
    """What is known about the instruction that is being followed."""

    instruction_id: str
    text: str
    started_ns: int
    meaning: Annotations | None = None
    """As last heard; None until it is heard again after a restart."""
    decisions: int = 0
    goal: Goal | None = None
    """The last one that was sent."""
    pace: Pace | None = None
    """None until the first decision of this process."""
    failures: int = 0
    """Goals that failed one after the other."""
    idle: int = 0
    """Decisions one after the other in which nothing was left to look at."""
    paused_ns: int = 0
    """Time spent under the stop latch, or waiting for an answer."""
    settled: Floats | None = None
    """(2,) Where the thing is that was meant beyond doubt when last asked, map frame [m]."""
    driving: bool = False
    """Whether the last goal that was sent has not ended."""
    homeward: bool = False
    """Whether what was wanted is being brought to where the instruction was given."""
    final: Ending | None = None
    """How it ends once the arm is folded."""
    refused: list[Floats] = field(default_factory=list[Floats])
    tried: list[Floats] = field(default_factory=list[Floats])

    @property
    def mode(self) -> str:
        """How to go there: "safely", "quickly" or "unknown"."""
        best = self.meaning.behaviors[:1] if self.meaning else ()
        return best[0].mode if best else "unknown"

    @property
    def wanted(self) -> str:
        """Class of what is looked for, "" while that is not known."""
        best = self.meaning.behaviors[:1] if self.meaning else ()
        return best[0].object if best else ""

    @property
    def inside(self) -> str:
        """Class of the thing that it lies in, "" where no such is named."""
        best = self.meaning.behaviors[:1] if self.meaning else ()
        return best[0].landmark if best and best[0].relation == "inside" else ""

    @property
    def action(self) -> str:
        """What is to be done: "navigate", "pick", "retrieve"; "" while that is not known."""
        best = self.meaning.behaviors[:1] if self.meaning else ()
        return best[0].action if best else ""

    def revise(self, annotations: Annotations) -> bool:
        """Take up what the instruction means now; True if that is something else than before."""
        before, self.meaning = self.meaning, annotations
        if before is None or _evidence(before) == _evidence(annotations):
            return False
        self.text, self.pace, self.idle = annotations.text, None, 0
        self.settled = None
        self.tried.clear()
        return True

    def searching_s(self, stamp_ns: int) -> float:
        """Time since the start, without pauses [s]."""
        return (stamp_ns - self.started_ns - self.paused_ns) / 1e9

    def memory(self, stamp_ns: int) -> Memory:
        """What the next decision has to know of the earlier ones."""
        under_way = self.pace is not None and self.pace.ended_ns is None
        return Memory(
            refused=np.array(self.refused).reshape(-1, 2),
            tried=np.array(self.tried).reshape(-1, 3),
            current=self.pace.following if self.pace and under_way else None,
            searching_s=self.searching_s(stamp_ns),
            wanted=self.wanted,
            inside=self.inside,
            settled=self.settled,
            words=words_of(self.meaning.behaviors if self.meaning else ()),
        )

    def goal_ended(self, status: GoalStatus, map_from_base: Pose2) -> None:
        """Learn how the goal ended; anything but the end of the current goal is ignored."""
        if self.goal is None or status.goal_id != self.goal.id or self.pace is None:
            return
        if status.state is TaskState.ACTIVE or self.pace.ended_ns is not None:
            return
        self.pace.ended_ns = status.stamp_ns
        pose = self.goal.map_from_goal
        missed = math.hypot(pose.x - map_from_base.x, pose.y - map_from_base.y) > _missed_by
        if status.state is not TaskState.SUCCEEDED or missed:
            self.refused.append(np.array([pose.x, pose.y]))
        self.failures = self.failures + 1 if status.state is TaskState.FAILED else 0
        self.tried.append(np.array([pose.x, pose.y, pose.yaw]))

    def arm_ended(self, stamp_ns: int) -> None:
        """Decide afresh once what the arm did has entered the belief."""
        if self.pace:
            self.pace.ended_ns = stamp_ns

    def refuse(self, map_from_base: Pose2) -> None:
        """Where the robot stands it cannot do what it came for."""
        self.refused.append(np.array([map_from_base.x, map_from_base.y]))

    def go_on(self, paused_ns: int) -> None:
        """After a pause, decide afresh."""
        self.paused_ns += paused_ns
        self.pace = None

    def ending_before_choice(self, stamp_ns: int) -> Ending | None:
        """Whether it is over whatever the policy would choose."""
        if self.searching_s(stamp_ns) > time_limit_s:
            reason = f"not done within {time_limit_s:.0f} s"
            return Ending(TaskState.FAILED, Failure.TIMEOUT, reason)
        if self.idle >= _idle_in_a_row:
            return Ending(TaskState.FAILED, Failure.NEVER_FOUND, "nothing is left to look at")
        if self.failures >= _failures_in_a_row:
            reason = f"{self.failures} goals in a row could not be reached"
            return Ending(TaskState.FAILED, Failure.PLANNER_FAILED, reason)
        return None

    def choose(
        self,
        policy: BeliefPolicy,
        belief: MapBelief,
        referents: Referents,
        grid: OccupancyGrid,
        map_from_base: Pose2,
    ) -> Choice | None:
        """Decide, if it is time to; remembers the circumstances."""
        memory = self.memory(belief.stamp_ns)
        goal = policy.goal_of(referents, memory)
        self.settled = None if goal is None else place_of(referents, goal)
        if self.pace and not self.pace.is_due(belief, referents, map_from_base, goal):
            return None
        choice = policy.decide(belief, referents, grid, map_from_base, memory)
        self.decisions += 1
        following = choice.candidates.take(np.array([choice.chosen], np.int32))
        hidden = hidden_mass(referents, following)
        passing_m = policy.passing_m(self.wanted)
        self.pace = Pace(
            belief.stamp_ns, map_from_base, seen_objects(belief), following, hidden, passing_m
        )
        if choice.is_idle:
            self.pace.ended_ns = belief.stamp_ns
        self.idle = self.idle + 1 if choice.is_idle else 0
        return choice


def ending_at_once(annotations: Annotations) -> Ending | None:
    """Whether an utterance needs no behaviour at all."""
    if annotations.revises:
        return Ending(TaskState.SUCCEEDED, None, "noted")
    if not annotations.understood:
        reason = _why_not_understood(annotations)
        return Ending(TaskState.FAILED, Failure.NOT_UNDERSTOOD, reason)
    if not annotations.behaviors:
        return Ending(TaskState.SUCCEEDED, None, "noted")
    return None


def awaits_answer(annotations: Annotations) -> bool:
    """Whether nothing can be done before a question is answered that has answers."""
    return not annotations.understood and bool(annotations.question and annotations.options)


def no_answer(annotations: Annotations) -> Ending:
    """How an instruction ends whose question nobody answered."""
    reason = f"no answer within {answer_limit_s:.0f} s to: {annotations.question}"
    return Ending(TaskState.FAILED, Failure.NOT_UNDERSTOOD, reason)


def _evidence(annotations: Annotations) -> tuple[object, ...]:
    """What of an instruction's meaning decides where to go."""
    return (annotations.annotations, annotations.behaviors, annotations.not_meant)


def _why_not_understood(annotations: Annotations) -> str:
    if annotations.unknown_words:
        return f"not understood: {', '.join(annotations.unknown_words)}"
    return annotations.question or "not understood: it fits nothing that the robot can do"
