"""The policy as a process: follows one instruction at a time and tells the truth about it."""

from collections.abc import Iterable

import numpy as np

from robots.catalogue import robot_of
from schemas import topics
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from schemas.language import Annotations, Behaviors
from schemas.motion import StopLatch
from schemas.run import RunConfig
from schemas.sensing import Odometry
from schemas.task import (
    CancelRequest,
    Goal,
    GoalStatus,
    Handling,
    HandlingGoal,
    HandlingStatus,
    InstructionStatus,
    TaskState,
)
from schemas.topics import Handlers, Output
from services.policy.cost import Cost
from services.policy.errand import (
    Ending,
    Errand,
    answer_limit_s,
    awaits_answer,
    ending_at_once,
    no_answer,
)
from services.policy.hands import in_words
from services.policy.handwork import Ask, Handwork
from services.policy.linear import default_expert, load_linear, weights_path
from services.policy.pairing import Pairing, Reading
from services.policy.policy import BeliefPolicy, Choice
from services.policy.reports import decision_of, goal_of, halt, progress, status_of
from services.policy.rule import load_rule


def own_policy(run: RunConfig) -> BeliefPolicy:
    """The policy that the robot of a run comes with."""
    return BeliefPolicy(robot_of(run), _cost_of(run.robot))


class PolicyNode:
    """Chooses where to go, and when to stop.

    Args:
        run: names the robot.
        rng: not used, the policy is deterministic.
        policy: another one than the robot's own.
    """

    def __init__(
        self, run: RunConfig, rng: np.random.Generator, policy: BeliefPolicy | None = None
    ) -> None:
        del rng
        self._spec = robot_of(run)
        self._policy = policy or own_policy(run)
        self._errand: Errand | None = None
        self._waiting: Errand | None = None
        self._asked_ns = 0
        self._pairing = Pairing("", 0)
        self._ended: set[str] = set()
        self._handwork = Handwork(self._policy.standing, self._spec.limits.linear_speed)
        self._belief: MapBelief | None = None
        self._arm_said = ""
        self._grid: OccupancyGrid | None = None
        self._map_from_odom: Pose2 | None = None
        self._odom_from_base: Pose2 | None = None
        self._stopped_ns: int | None = None

    def handlers(self) -> Handlers:
        """Language, belief and what became of the goals; the belief sets the pace."""
        return {
            topics.STOP: self.on_stop,
            topics.ODOMETRY: self.on_odometry,
            topics.CANCEL: self.on_cancel,
            topics.ANNOTATIONS: self.on_annotations,
            topics.GRID: self.on_grid,
            topics.BELIEF: self.on_belief,
            topics.BEHAVIORS: self.on_behaviors,
            topics.GOAL_STATUS: self.on_goal_status,
            topics.HANDLING_STATUS: self.on_handling_status,
        }

    def resume(self) -> Handlers:
        """The instruction goes on, and one that has ended does not start again."""
        return {
            topics.INSTRUCTION_STATUS: self.on_own_status,
            topics.HANDLING_GOAL: self.on_own_handling_goal,
        }

    def on_own_handling_goal(self, goal: HandlingGoal) -> Iterable[Output]:
        """Know whether the arm may be out."""
        self._handwork.hands.folded = goal.action is Handling.STOW
        return ()

    def on_own_status(self, status: InstructionStatus) -> Iterable[Output]:
        """Take up an instruction; its next decision is made afresh."""
        if status.state is TaskState.ACTIVE:
            self._begin(
                Errand(
                    instruction_id=status.instruction_id,
                    text=status.text,
                    started_ns=status.started_ns,
                    decisions=status.decisions,
                )
            )
        else:
            self._ended.add(status.instruction_id)
        return ()

    def on_annotations(self, annotations: Annotations) -> Iterable[Output]:
        """Start an instruction, wait for an answer about it, revise it, or say why not."""
        name = annotations.instruction_id
        if name in self._ended:
            return
        if self._errand and self._errand.instruction_id == name and annotations.understood:
            yield from self._revise(self._errand, annotations)
        elif awaits_answer(annotations):
            yield from self._wait(annotations)
        else:
            yield from self._hear(annotations)

    def on_belief(self, belief: MapBelief) -> Iterable[Output]:
        """Decide, where no behaviours are to be expected."""
        self._map_from_odom, self._belief = belief.map_from_odom, belief
        yield from self._follow(self._pairing.take_belief(belief))

    def on_behaviors(self, behaviors: Behaviors) -> Iterable[Output]:
        """Decide, once it is known what is meant in each hypothesis."""
        yield from self._follow(self._pairing.take_behaviors(behaviors))

    def on_grid(self, grid: OccupancyGrid) -> Iterable[Output]:
        """Use it from the next decision on."""
        self._grid = grid
        return ()

    def on_odometry(self, odometry: Odometry) -> Iterable[Output]:
        """Know where the robot is between beliefs, and how long an answer is waited for."""
        self._odom_from_base = odometry.odom_from_base
        waiting = self._waiting
        if waiting and odometry.stamp_ns - self._asked_ns > answer_limit_s * 1e9:
            assert waiting.meaning is not None
            yield from self._drop_waiting(no_answer(waiting.meaning), odometry.stamp_ns)

    def on_goal_status(self, status: GoalStatus) -> Iterable[Output]:
        """Learn that a goal was reached or given up; the next belief leads to a decision."""
        errand, pose = self._errand, self._map_from_base()
        if errand and pose:
            if not (errand.homeward or self._handwork.halting):
                errand.goal_ended(status, pose)
            asked = self._handwork.arrived(errand, self._belief, status, pose)
            yield from self._do(errand, asked, status.stamp_ns)

    def on_handling_status(self, status: HandlingStatus) -> Iterable[Output]:
        """Learn what the arm holds, and go on where it has done its part."""
        errand = self._errand
        asked = self._handwork.handled(errand, self._belief, status, self._map_from_base())
        if errand:
            yield from self._say_what_the_arm_does(errand, status)
            yield from self._do(errand, asked, status.stamp_ns)

    def _say_what_the_arm_does(self, errand: Errand, status: HandlingStatus) -> Iterable[Output]:
        if self._handwork.hands.pending and status.reason != self._arm_said:
            self._arm_said = status.reason
            yield topics.INSTRUCTION_STATUS.of(progress(errand, status.stamp_ns, status.reason))

    def on_stop(self, latch: StopLatch) -> Iterable[Output]:
        """Decide nothing while stopped, and afresh afterwards."""
        if latch.stopped:
            self._stopped_ns = self._stopped_ns or latch.stamp_ns
        elif self._stopped_ns is not None:
            if self._errand:
                self._errand.go_on(latch.stamp_ns - self._stopped_ns)
            self._stopped_ns = None
        return ()

    def on_cancel(self, request: CancelRequest) -> Iterable[Output]:
        """Drop the instruction and stand still."""
        ending = Ending(TaskState.CANCELLED, None, f"cancelled by {request.source}")
        yield from self._drop_waiting(ending, request.stamp_ns)
        if self._errand:
            yield from self._end(self._errand, ending, request.stamp_ns)

    def _hear(self, annotations: Annotations) -> Iterable[Output]:
        stamp_ns = annotations.stamp_ns
        heard = self._heard(annotations)
        at_once = ending_at_once(annotations)
        if at_once is None:
            replaced = Ending(TaskState.CANCELLED, None, "replaced by a newer instruction")
            if self._errand:
                yield from self._end(self._errand, replaced, stamp_ns)
            yield from self._drop_waiting(replaced, stamp_ns)
            self._begin(heard)
            yield topics.INSTRUCTION_STATUS.of(progress(heard, stamp_ns, "understood"))
            return
        self._ended.add(heard.instruction_id)
        yield topics.INSTRUCTION_STATUS.of(status_of(heard, stamp_ns, at_once))
        yield from self._go_on(stamp_ns, "going on")

    def _heard(self, annotations: Annotations) -> Errand:
        """The errand of an utterance; one that was waited for is no longer."""
        stamp_ns, name = annotations.stamp_ns, annotations.instruction_id
        heard = Errand(name, annotations.text, stamp_ns, meaning=annotations)
        waiting = self._waiting
        if waiting and waiting.instruction_id == name:
            self._waiting, heard.started_ns = None, waiting.started_ns
            heard.paused_ns = stamp_ns - waiting.started_ns
        return heard

    def _wait(self, annotations: Annotations) -> Iterable[Output]:
        """Stay where the robot is, or go on with an earlier instruction, until it is answered."""
        stamp_ns, name = annotations.stamp_ns, annotations.instruction_id
        if self._errand and self._errand.instruction_id == name:
            # After a restart, or a correction that is not clear: what was begun is left alone.
            yield from self._halt(self._errand, stamp_ns)
            self._waiting, self._errand = self._errand, None
        heard = self._heard(annotations)
        replaced = Ending(TaskState.CANCELLED, None, "replaced by a newer instruction")
        yield from self._drop_waiting(replaced, stamp_ns)
        self._waiting, self._asked_ns = heard, stamp_ns
        reason = f"waiting for an answer: {annotations.question}"
        yield topics.INSTRUCTION_STATUS.of(progress(heard, stamp_ns, reason))
        yield from self._go_on(stamp_ns, "going on")

    def _revise(self, errand: Errand, annotations: Annotations) -> Iterable[Output]:
        if errand.revise(annotations):
            self._pairing = Pairing(errand.instruction_id, annotations.stamp_ns)
            yield from self._go_on(annotations.stamp_ns, f"going on: {annotations.text}")

    def _go_on(self, stamp_ns: int, reason: str) -> Iterable[Output]:
        """The last status is what late joiners see: let it be the one that runs."""
        if self._errand:
            yield topics.INSTRUCTION_STATUS.of(progress(self._errand, stamp_ns, reason))

    def _drop_waiting(self, ending: Ending, stamp_ns: int) -> Iterable[Output]:
        waiting, self._waiting = self._waiting, None
        if waiting:
            self._ended.add(waiting.instruction_id)
            yield topics.INSTRUCTION_STATUS.of(status_of(waiting, stamp_ns, ending))
            yield from self._go_on(stamp_ns, "going on")

    def _follow(self, reading: Reading | None) -> Iterable[Output]:
        errand, pose = self._errand, self._map_from_base()
        if errand is None or self._stopped_ns is not None or pose is None:
            return
        if reading is None or self._grid is None:
            return
        belief, referents = reading
        over = errand.ending_before_choice(belief.stamp_ns)
        if over is not None:
            yield from self._end(errand, over, belief.stamp_ns)
            return
        asked = self._handwork.before_choice(errand, belief, pose)
        if asked is not None:
            yield from self._do(errand, asked, belief.stamp_ns)
            return
        choice = errand.choose(self._policy, belief, referents, self._grid, pose)
        if choice is not None:
            yield from self._act(errand, belief, choice)

    def _act(self, errand: Errand, belief: MapBelief, choice: Choice) -> Iterable[Output]:
        decision = decision_of(errand, belief, choice)
        yield topics.DECISION.of(decision)
        if choice.confirms:
            asked = self._handwork.confirmed(errand, belief, choice)
            yield from self._do(errand, asked, belief.stamp_ns)
            return
        # Before the goal: a restarted policy then never sends a second goal of the same id.
        status = progress(errand, belief.stamp_ns, decision.reason)
        yield topics.INSTRUCTION_STATUS.of(status)
        if not choice.kept and not choice.is_idle:
            goal = goal_of(errand, belief, choice, self._spec)
            yield from self._do(errand, self._handwork.drive(errand, goal), belief.stamp_ns)

    def _do(self, errand: Errand, asked: list[Ask], stamp_ns: int) -> Iterable[Output]:
        """Ask base and arm for what is to be done, or end the instruction."""
        for one in asked:
            if isinstance(one, Ending):
                yield from self._end(errand, one, stamp_ns)
            elif isinstance(one, Goal):
                yield topics.GOAL.of(one)
            else:
                yield topics.INSTRUCTION_STATUS.of(progress(errand, stamp_ns, in_words(one)))
                yield topics.HANDLING_GOAL.of(one)

    def _begin(self, errand: Errand) -> None:
        self._errand = errand
        self._handwork.begin()
        self._pairing = Pairing(errand.instruction_id, errand.started_ns + errand.paused_ns)

    def _end(self, errand: Errand, ending: Ending, stamp_ns: int) -> Iterable[Output]:
        self._errand = None
        self._ended.add(errand.instruction_id)
        yield from self._halt(errand, stamp_ns)
        hands = self._handwork.hands
        if ending.state is not TaskState.SUCCEEDED and not hands.folded:
            # What was broken off leaves the arm out, in a box perhaps.
            yield topics.HANDLING_GOAL.of(hands.ask(errand.instruction_id, stamp_ns, Handling.STOW))
        yield topics.INSTRUCTION_STATUS.of(status_of(errand, stamp_ns, ending))

    def _halt(self, errand: Errand, stamp_ns: int) -> Iterable[Output]:
        pose = self._map_from_base()
        if pose is not None and errand.decisions:
            yield topics.GOAL.of(halt(errand, pose, stamp_ns))

    def _map_from_base(self) -> Pose2 | None:
        if self._map_from_odom is None or self._odom_from_base is None:
            return None
        return self._map_from_odom @ self._odom_from_base


def _cost_of(robot: str) -> Cost:
    """What was learned for this robot, or else the rule that was set by hand."""
    learned = weights_path(robot, default_expert)
    return load_linear(learned) if learned.exists() else load_rule(robot)
