"""What the robot decided, tries and reports."""

from enum import StrEnum
from typing import Annotated

from msgspec import Struct

from schemas.arrays import Floats, Shape
from schemas.geometry import Pose2, Pose3


class TaskState(StrEnum):
    """Life of an instruction or of a goal."""

    ACTIVE = "active"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"


class Failure(StrEnum):
    """Why an instruction ended without success; closed set."""

    NOT_UNDERSTOOD = "not_understood"
    WRONG_OBJECT = "wrong_object"
    STOPPED_EARLY = "stopped_early"
    NEVER_FOUND = "never_found"
    TIMEOUT = "timeout"
    COLLISION = "collision"
    GRASP_FAILED = "grasp_failed"
    PLANNER_FAILED = "planner_failed"
    FAULT = "fault"


class Decision(Struct, frozen=True, kw_only=True):
    """One choice of the policy over everything it could do next (Eq. policy)."""

    stamp_ns: int
    instruction_id: str
    kinds: tuple[str, ...]
    """Of each candidate: "observed", "hypothesised", "frontier", "inside" or "stop"."""
    positions: Annotated[Floats, Shape("K 2")]
    """Map frame [m]."""
    costs: Annotated[Floats, Shape("K")]
    """Lower is better; the policy's own scale, in metres to go."""
    chosen: int
    confirmed: float
    """Probability that the robot stands at the thing that was meant."""
    reason: str
    """One sentence for the operator."""


class Goal(Struct, frozen=True, kw_only=True):
    """A place to be; the base answers with `GoalStatus` of the same id."""

    stamp_ns: int
    id: str
    instruction_id: str
    map_from_goal: Pose2
    """The yaw is where to look on arrival."""
    tolerance: float
    """Close enough [m]."""
    face: bool
    """Whether the yaw matters."""
    speed_limit: float
    """[m/s]"""


class GoalStatus(Struct, frozen=True, kw_only=True):
    """How far a goal is."""

    stamp_ns: int
    goal_id: str
    state: TaskState
    reason: str
    path: Annotated[Floats, Shape("K 2")]
    """Rest of the planned path, map frame [m]."""


class Handling(StrEnum):
    """What the arm can be told to do."""

    LOOK = "look"
    """Hold the wrist's camera so that it sees into a thing."""
    PICK = "pick"
    """Take a thing into the gripper and lift it."""
    STOW = "stow"
    """Fold the arm for driving, with what it holds."""
    PLACE = "place"
    """Put down what it holds."""


class HandlingFailure(StrEnum):
    """Why the arm did not do it; closed set."""

    UNREACHABLE = "unreachable"
    TOO_BIG = "too_big"
    START_IN_COLLISION = "start_in_collision"
    GOAL_IN_COLLISION = "goal_in_collision"
    NO_PATH = "no_path"
    STUCK = "stuck"
    NOT_HELD = "not_held"
    DROPPED = "dropped"
    LOST = "lost"
    """It is not where it was, or the base is not."""
    FULL = "full"
    """The gripper holds something already."""
    BLIND = "blind"
    """The wrist's camera gives no picture."""


class HandlingGoal(Struct, frozen=True, kw_only=True):
    """Something for the arm to do; the arm answers with `HandlingStatus` of the same id."""

    stamp_ns: int
    id: str
    instruction_id: str
    action: Handling
    label: str
    """Class of the thing."""
    map_from_thing: Pose3
    """Middle of the upright box around it, x along its length."""
    size: tuple[float, float, float]
    """Of that box: length, width, height [m]."""


class HandlingStatus(Struct, frozen=True, kw_only=True):
    """How far the arm is."""

    stamp_ns: int
    goal_id: str
    state: TaskState
    failure: HandlingFailure | None
    reason: str
    """One sentence: "the box wall is in the way", ..."""
    holding: str
    """Class of what is in the gripper; empty if nothing is."""


class CancelRequest(Struct, frozen=True, kw_only=True):
    """Drop the instruction that is being followed."""

    stamp_ns: int
    source: str


class InstructionStatus(Struct, frozen=True, kw_only=True):
    """The truth about an instruction, told by the policy."""

    stamp_ns: int
    instruction_id: str
    text: str
    state: TaskState
    failure: Failure | None
    reason: str
    """One sentence: "goal confirmed", "no word of it is known", ..."""
    started_ns: int
    decisions: int
