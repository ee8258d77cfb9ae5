"""What the policy tells others: decisions, goals and the state of instructions."""

import numpy as np

from robots.spec import RobotSpec
from schemas.belief import MapBelief
from schemas.geometry import Pose2
from schemas.task import Decision, Goal, InstructionStatus, TaskState
from services.policy.candidates import Kind
from services.policy.errand import Ending, Errand
from services.policy.policy import Choice

_speed_share = {"safely": 0.5, "quickly": 1.0}
_usual_speed_share = 0.8
_tolerance = 0.15
_wide = 100.0
"""Tolerance that any place meets [m]."""

_reasons = {
    Kind.OBSERVED: "it was seen: going there",
    Kind.HYPOTHESISED: "looking where it may be",
    Kind.FRONTIER: "looking where nobody has looked",
    Kind.INSIDE: "going to look into it",
    Kind.STOP: "standing at it",
}


def decision_of(errand: Errand, belief: MapBelief, choice: Choice) -> Decision:
    """Every candidate with its cost, and why this one."""
    gain = float(choice.gains[choice.chosen])
    count = len(choice.candidates)
    return Decision(
        stamp_ns=belief.stamp_ns,
        instruction_id=errand.instruction_id,
        kinds=tuple(str(kind) for kind in choice.candidates.kinds),
        positions=choice.candidates.target,
        costs=choice.costs,
        chosen=choice.chosen,
        confirmed=choice.confirmed,
        reason=f"{_reasons[choice.kind]} (worth {gain:.2f}, best of {count})",
    )


def goal_of(errand: Errand, belief: MapBelief, choice: Choice, spec: RobotSpec) -> Goal:
    """Where the chosen candidate stands and looks; in a place that was seen, anywhere."""
    x, y, yaw = choice.candidates.pose[choice.chosen].tolist()
    return Goal(
        stamp_ns=belief.stamp_ns,
        id=f"{errand.instruction_id}/{errand.decisions}",
        instruction_id=errand.instruction_id,
        map_from_goal=Pose2(x, y, yaw),
        tolerance=_tolerance,
        face=not _is_into_place(belief, choice, spec),
        speed_limit=spec.limits.linear_speed * _speed_share.get(errand.mode, _usual_speed_share),
    )


def _is_into_place(belief: MapBelief, choice: Choice, spec: RobotSpec) -> bool:
    aim = choice.candidates.object_id[choice.chosen]
    rows = np.flatnonzero(belief.seen & (belief.node == aim))
    return any(belief.classes[belief.class_index[row]] in spec.symbols.locations for row in rows)


def halt(errand: Errand, map_from_base: Pose2, stamp_ns: int) -> Goal:
    """A goal that is met where the robot stands, which ends any other."""
    return Goal(
        stamp_ns=stamp_ns,
        id=f"{errand.instruction_id}/halt",
        instruction_id=errand.instruction_id,
        map_from_goal=map_from_base,
        tolerance=_wide,
        face=False,
        speed_limit=0.0,
    )


def progress(errand: Errand, stamp_ns: int, reason: str) -> InstructionStatus:
    """The instruction is being followed."""
    return status_of(errand, stamp_ns, Ending(TaskState.ACTIVE, None, reason))


def status_of(errand: Errand, stamp_ns: int, ending: Ending) -> InstructionStatus:
    """The truth about an instruction."""
    return InstructionStatus(
        stamp_ns=stamp_ns,
        instruction_id=errand.instruction_id,
        text=errand.text,
        state=ending.state,
        failure=ending.failure,
        reason=ending.reason,
        started_ns=errand.started_ns,
        decisions=errand.decisions,
    )
