"""What the arm holds and is busy with, as far as the policy knows, and what to do when it fails."""

from dataclasses import dataclass

from schemas.belief import MapBelief
from schemas.geometry import Pose2, Pose3
from schemas.task import (
    Failure,
    Goal,
    Handling,
    HandlingFailure,
    HandlingGoal,
    HandlingStatus,
    TaskState,
)

TAKING = ("pick", "retrieve")
"""Actions that end with the thing in the gripper."""
_tries = 4
"""Failures of the arm in one instruction, from which on it is given up."""
_put_aside = Pose2(0.75, -0.5, 0.0)
"""Where what was held is put down to have the hand free, from the base."""
_aside_height = 0.08
"""Of the middle of a thing above the ground that one does not see while one holds it [m]."""
_at_once: dict[HandlingFailure, Failure] = {
    HandlingFailure.TOO_BIG: Failure.GRASP_FAILED,
    HandlingFailure.STUCK: Failure.FAULT,
    HandlingFailure.BLIND: Failure.FAULT,
}
"""Where another try is of no use."""
_from_elsewhere = (
    HandlingFailure.UNREACHABLE,
    HandlingFailure.START_IN_COLLISION,
    HandlingFailure.GOAL_IN_COLLISION,
    HandlingFailure.NO_PATH,
)
"""What may go better from another side."""
_upright = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Verdict:
    """What a failure of the arm means for the instruction."""

    failure: Failure | None
    """None: it goes on."""
    move: bool = False
    """Whether the robot had better stand elsewhere."""


@dataclass
class Hands:
    """The arm over all instructions; a robot without one never asks anything of it."""

    holding: str = ""
    """Class of what is in the gripper."""
    folded: bool = True
    """Whether the arm is as it may be for driving."""
    pending: HandlingGoal | None = None
    """What was asked for and has not ended."""
    then: Goal | None = None
    """Where to drive once the arm is folded."""
    asked: int = 0
    failures: int = 0
    """In this instruction."""

    def begin(self) -> None:
        """A new instruction: what is held is held on to."""
        self.pending, self.then, self.failures = None, None, 0

    def ask(
        self,
        instruction_id: str,
        stamp_ns: int,
        action: Handling,
        label: str = "",
        place: Pose3 | None = None,
        size: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> HandlingGoal:
        """The goal that asks the arm for something; its end is waited for."""
        self.asked += 1
        self.folded = False
        self.pending = HandlingGoal(
            stamp_ns=stamp_ns,
            # The arm never begins a goal of an id again: a restarted policy must not repeat one.
            id=f"{instruction_id}/arm/{stamp_ns}/{self.asked}",
            instruction_id=instruction_id,
            action=action,
            label=label,
            map_from_thing=place or Pose3((0.0, 0.0, 0.0), _upright),
            size=size,
        )
        return self.pending

    def hear(self, status: HandlingStatus) -> HandlingGoal | None:
        """Learn how the arm stands; the goal that this ends, if it ends one."""
        self.holding = status.holding
        goal = self.pending
        if goal is None or status.goal_id != goal.id or status.state is TaskState.ACTIVE:
            return None
        self.pending = None
        self.folded = goal.action is Handling.STOW and status.state is TaskState.SUCCEEDED
        return goal

    def judge(self, status: HandlingStatus) -> Verdict:
        """What to do about a goal that the arm did not reach."""
        failure = status.failure
        assert failure is not None
        self.failures += 1
        if failure in _at_once:
            return Verdict(_at_once[failure])
        if self.failures >= _tries:
            return Verdict(Failure.GRASP_FAILED)
        return Verdict(None, move=failure in _from_elsewhere)


def in_words(goal: HandlingGoal) -> str:
    """What the arm is asked for, for people."""
    match goal.action:
        case Handling.LOOK:
            return f"looking into the {goal.label}"
        case Handling.PICK:
            return f"taking the {goal.label}"
        case Handling.STOW:
            return "folding the arm"
        case Handling.PLACE:
            return f"putting down the {goal.label}"


def place_of_row(belief: MapBelief, row: int) -> tuple[Pose3, tuple[float, float, float]]:
    """Where a seen thing stands, map frame, and its size."""
    x, y = belief.position[row].tolist()
    length, width, height = belief.extent[row].tolist()
    return Pose3((x, y, height / 2), _upright), (length, width, height)


def aside(map_from_base: Pose2) -> Pose3:
    """Where to put down what is in the way, map frame."""
    spot = map_from_base @ _put_aside
    return Pose3((spot.x, spot.y, _aside_height), _upright)
