"""What an instruction has the arm do between the robot's ways, and at their end.

    drive to a box --> look into it --> fold the arm --> drive on, or
    stand at the thing that is meant --> take it --> fold the arm with it --> bring it, and done

The base and the arm never move at the same time: whoever moves is waited for.
"""

from dataclasses import replace

import numpy as np

from schemas.belief import MapBelief
from schemas.geometry import Pose2
from schemas.task import Failure, Goal, GoalStatus, Handling, HandlingGoal, HandlingStatus
from schemas.task import TaskState as State
from services.policy.candidates import Kind
from services.policy.errand import Ending, Errand
from services.policy.hands import TAKING, Hands, aside, place_of_row
from services.policy.policy import Choice
from services.policy.standing import Standing

Ask = Goal | HandlingGoal | Ending
"""Something to be done now: by the base, by the arm, or to be said."""

_found = Ending(State.SUCCEEDED, None, "goal confirmed")
_home_tolerance = 0.25
"""What is brought is brought as near to where it was asked for [m]."""
_ways_home = 3
_anywhere = 100.0
"""Tolerance that any place meets [m]."""


class Handwork:
    """The arm's part of instructions.

    Args:
        standing: where the robot must stand for its arm to reach something.
        speed: with which something is brought [m/s].
    """

    def __init__(self, standing: Standing, speed: float) -> None:
        self._standing, self._speed = standing, speed
        self.hands = Hands()
        self._halting = ""
        """Id of the goal that lets the base stand still before the arm moves."""

    @property
    def halting(self) -> bool:
        """Whether the base is being brought to a stand."""
        return bool(self._halting)

    def begin(self) -> None:
        """A new instruction."""
        self._halting = ""
        self.hands.begin()

    def before_choice(
        self, errand: Errand, belief: MapBelief, map_from_base: Pose2
    ) -> list[Ask] | None:
        """What comes before the next decision; None if that may be taken."""
        hands = self.hands
        if hands.pending or errand.homeward or errand.final or self._halting:
            return []
        needs_hand = errand.action in TAKING or bool(errand.inside)
        if not hands.holding or not needs_hand:
            return None
        if hands.holding == errand.wanted and errand.action in TAKING:
            return self._carry(errand, belief)
        return [
            hands.ask(
                errand.instruction_id, belief.stamp_ns, Handling.PLACE, hands.holding,
                aside(map_from_base),
            )
        ]  # fmt: skip

    def confirmed(self, errand: Errand, belief: MapBelief, choice: Choice) -> list[Ask]:
        """The robot stands at what is meant: that is the end, or the beginning of taking it."""
        if errand.action in TAKING and errand.driving:
            return [self._halt(errand, belief)]
        if errand.action in TAKING:
            number = int(choice.candidates.object_id[choice.chosen])
            return [self._ask_about(errand, belief, Handling.PICK, number, errand.wanted)]
        return self.fold(errand, belief.stamp_ns, _found)

    def drive(self, errand: Errand, goal: Goal) -> list[Ask]:
        """Drive there, with the arm folded."""
        if self.hands.folded:
            return [_sent(errand, goal)]
        self.hands.then = goal
        return [self.hands.ask(errand.instruction_id, goal.stamp_ns, Handling.STOW)]

    def fold(self, errand: Errand, stamp_ns: int, ending: Ending) -> list[Ask]:
        """End the instruction, with the arm folded if it can be."""
        if self.hands.folded:
            return [ending]
        errand.final = ending
        return [self.hands.ask(errand.instruction_id, stamp_ns, Handling.STOW)]

    def arrived(
        self, errand: Errand, belief: MapBelief | None, status: GoalStatus, map_from_base: Pose2
    ) -> list[Ask]:
        """The base has come to the end of a way, or given it up."""
        own = errand.goal is not None and status.goal_id == errand.goal.id
        if not own or status.state is State.ACTIVE or belief is None:
            return []
        errand.driving = False
        if self._halting:
            self._halting = ""
            errand.go_on(0)
            return []
        if errand.homeward:
            return self._came_home(errand, belief, status)
        aim = errand.pace.following if errand.pace else None
        if aim is None or aim.kinds[0] is not Kind.INSIDE or self.hands.pending:
            return []
        number = int(aim.object_id[0])
        if not self._stands_at(belief, number, map_from_base, errand):
            return []
        return [self._ask_about(errand, belief, Handling.LOOK, number, errand.inside)]

    def handled(
        self,
        errand: Errand | None,
        belief: MapBelief | None,
        status: HandlingStatus,
        map_from_base: Pose2 | None,
    ) -> list[Ask]:
        """The arm says how it stands."""
        goal = self.hands.hear(status)
        if errand is None or belief is None:
            return []
        if goal is None:
            if errand.homeward and not status.holding:
                # It fell on the way home: it is looked for again.
                errand.homeward = False
                errand.go_on(0)
            return []
        if status.state is State.SUCCEEDED:
            return self._succeeded(errand, belief, goal, status)
        return self._failed(errand, goal, status, map_from_base)

    def _succeeded(
        self, errand: Errand, belief: MapBelief, goal: HandlingGoal, status: HandlingStatus
    ) -> list[Ask]:
        match goal.action:
            case Handling.LOOK | Handling.PLACE:
                errand.arm_ended(status.stamp_ns)
                return []
            case Handling.PICK:
                return [self.hands.ask(errand.instruction_id, status.stamp_ns, Handling.STOW)]
            case Handling.STOW:
                return self._folded(errand, belief)

    def _folded(self, errand: Errand, belief: MapBelief) -> list[Ask]:
        if errand.final:
            return [errand.final]
        then, self.hands.then = self.hands.then, None
        if then is not None:
            return [_sent(errand, then)]
        if self.hands.holding and self.hands.holding == errand.wanted:
            return self._carry(errand, belief)
        errand.arm_ended(belief.stamp_ns)
        return []

    def _failed(
        self,
        errand: Errand,
        goal: HandlingGoal,
        status: HandlingStatus,
        map_from_base: Pose2 | None,
    ) -> list[Ask]:
        self.hands.then = None
        if errand.final:
            # That the arm does not fold takes nothing from what was reached before.
            return [replace(errand.final, reason=f"{errand.final.reason}; {status.reason}")]
        if status.state is State.CANCELLED:
            errand.go_on(0)
            return []
        verdict = self.hands.judge(status)
        if verdict.failure:
            return [Ending(State.FAILED, verdict.failure, status.reason)]
        if verdict.move and goal.action is not Handling.STOW and map_from_base:
            errand.refuse(map_from_base)
        errand.arm_ended(status.stamp_ns)
        return []

    def _carry(self, errand: Errand, belief: MapBelief) -> list[Ask]:
        """It is in the gripper: bring it, or that is all."""
        if not self.hands.folded:
            return [self.hands.ask(errand.instruction_id, belief.stamp_ns, Handling.STOW)]
        held = f"the {self.hands.holding} is in the gripper"
        if errand.action != "retrieve":
            return [Ending(State.SUCCEEDED, None, held)]
        errand.homeward = True
        errand.goal = Goal(
            stamp_ns=belief.stamp_ns,
            id=f"{errand.instruction_id}/home/{errand.decisions}/{errand.failures}",
            instruction_id=errand.instruction_id,
            map_from_goal=belief.viewer,
            tolerance=_home_tolerance,
            face=False,
            speed_limit=self._speed,
        )
        return [errand.goal]

    def _halt(self, errand: Errand, belief: MapBelief) -> Goal:
        """Let the base stand: it may have come to the thing on its way to somewhere else."""
        self._halting = f"{errand.instruction_id}/stand/{errand.decisions}"
        errand.goal = Goal(
            stamp_ns=belief.stamp_ns,
            id=self._halting,
            instruction_id=errand.instruction_id,
            map_from_goal=belief.map_from_base,
            tolerance=_anywhere,
            face=False,
            speed_limit=0.0,
        )
        return errand.goal

    def _came_home(self, errand: Errand, belief: MapBelief, status: GoalStatus) -> list[Ask]:
        if status.state is State.SUCCEEDED:
            held = f"the {self.hands.holding} was brought to where it was asked for"
            return [Ending(State.SUCCEEDED, None, held)]
        errand.failures += 1
        if errand.failures >= _ways_home:
            reason = f"the {self.hands.holding} is held; the way home: {status.reason}"
            return [Ending(State.FAILED, Failure.PLANNER_FAILED, reason)]
        return self._carry(errand, belief)

    def _ask_about(
        self, errand: Errand, belief: MapBelief, action: Handling, number: int, label: str
    ) -> HandlingGoal:
        place, size = place_of_row(belief, _row_of(belief, number))
        return self.hands.ask(errand.instruction_id, belief.stamp_ns, action, label, place, size)

    def _stands_at(
        self, belief: MapBelief, number: int, map_from_base: Pose2, errand: Errand
    ) -> bool:
        if number not in belief.node[belief.seen]:
            return False
        refused = np.array(errand.refused).reshape(-1, 2)
        return self._standing.is_at(belief, _row_of(belief, number), map_from_base, refused)


def _sent(errand: Errand, goal: Goal) -> Goal:
    errand.goal, errand.driving = goal, True
    return goal


def _row_of(belief: MapBelief, number: int) -> int:
    return int(np.flatnonzero(belief.seen & (belief.node == number))[0])
