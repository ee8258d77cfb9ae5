"""Manipulation as a process: goals for the arm in, motions out."""

from collections.abc import Iterable, Sequence

import numpy as np

from robots.catalogue import robot_of
from schemas import topics
from schemas.belief import MapBelief
from schemas.motion import GripperCommand, StopLatch
from schemas.perception import Bodies, Detections
from schemas.run import RunConfig
from schemas.sensing import JointState, Odometry
from schemas.task import HandlingGoal, HandlingStatus, TaskState
from schemas.topics import Handlers, Output
from services.manipulation.hand import Hand, Orders, Outcome
from services.manipulation.surroundings import Body, bodies_in
from services.manipulation.tasks import task_of
from services.manipulation.workspace import Picture, Workspace, grasp_felt

_report_ns = 500_000_000
_stopped = Outcome(TaskState.CANCELLED, None, "stopped: the arm holds where it is")
_replaced = Outcome(TaskState.CANCELLED, None, "replaced by a newer goal")


class ManipulationNode:
    """Looks into boxes, takes things, carries them and puts them down.

    Args:
        run: names the robot, which must have an arm.
        rng: of the search for ways.
    """

    def __init__(self, run: RunConfig, rng: np.random.Generator) -> None:
        self._work = Workspace(robot_of(run), rng)
        self._arm = self._work.arm
        self._hand = Hand(self._work)
        self._goal: HandlingGoal | None = None
        self._outcome = Outcome(TaskState.SUCCEEDED, None, "")
        self._reported_ns = 0
        self._ended: set[str] = set()
        self._stopped = False
        self._felt = ""
        self._unpaired: dict[bool, Detections] = {}

    def handlers(self) -> Handlers:
        """Goals and what is needed to reach them; the joints set the pace."""
        return {
            topics.STOP: self.on_stop,
            topics.ODOMETRY: self.on_odometry,
            topics.JOINT_STATE: self.on_joints,
            topics.DETECTIONS: self.on_detections,
            topics.BODIES: self.on_bodies,
            topics.BELIEF: self.on_belief,
            topics.HANDLING_GOAL: self.on_goal,
            topics.WRIST_DETECTIONS: self.on_wrist_detections,
            topics.WRIST_BODIES: self.on_wrist_bodies,
        }

    def resume(self) -> Handlers:
        """What ended does not begin again, and what is held is not forgotten."""
        return {topics.HANDLING_STATUS: self.on_own_status}

    def on_own_status(self, status: HandlingStatus) -> Iterable[Output]:
        """Remember a goal that ended, and what is in the gripper."""
        if status.state is not TaskState.ACTIVE:
            self._ended.add(status.goal_id)
        self._felt = status.holding
        return ()

    def on_stop(self, latch: StopLatch) -> Iterable[Output]:
        """Send nothing more, so that the arm holds; the goal is over."""
        self._stopped = latch.stopped
        if latch.stopped and self._hand.busy:
            self._hand.drop()
            yield self._told(_stopped, latch.stamp_ns)

    def on_odometry(self, odometry: Odometry) -> Iterable[Output]:
        """Know whether the base stands."""
        self._work.odom_from_base = odometry.odom_from_base
        return ()

    def on_belief(self, belief: MapBelief) -> Iterable[Output]:
        """Know where the map lies in the frame of dead reckoning."""
        self._work.map_from_odom = belief.map_from_odom
        return ()

    def on_detections(self, detections: Detections) -> Iterable[Output]:
        """Keep the classes of what the bodies of the same picture are."""
        self._unpaired[False] = detections
        return ()

    def on_wrist_detections(self, detections: Detections) -> Iterable[Output]:
        """The same for the wrist's camera."""
        self._unpaired[True] = detections
        return ()

    def on_bodies(self, bodies: Bodies) -> Iterable[Output]:
        """Remember what stands around."""
        detections = self._pair(bodies, of_wrist=False)
        if detections:
            self._work.see(_labelled(bodies, detections))
        return ()

    def on_wrist_bodies(self, bodies: Bodies) -> Iterable[Output]:
        """Take what the arm sees, which it may have been waiting for."""
        detections = self._pair(bodies, of_wrist=True)
        if detections:
            sought = tuple(c for c in detections.classes if c not in detections.unsought)
            seen = tuple(_labelled(bodies, detections))
            self._work.watch(Picture(bodies.stamp_ns, seen, sought))
        return ()

    def on_goal(self, goal: HandlingGoal) -> Iterable[Output]:
        """Begin it with the next reading of the joints."""
        known = self._goal is not None and self._goal.id == goal.id
        if goal.id in self._ended or known:
            return
        if self._hand.busy:
            self._hand.drop()
            yield self._told(_replaced, goal.stamp_ns)
        self._goal = goal
        if self._stopped:
            yield self._told(_stopped, goal.stamp_ns)
        else:
            self._hand.begin(lambda: task_of(self._work, goal))

    def on_joints(self, state: JointState) -> Iterable[Output]:
        """One control step."""
        joints, gap = self._read(state)
        if self._felt:
            self._work.grasp = grasp_felt(self._arm, self._felt, gap)
            self._felt = ""
        orders = self._hand.read(joints, gap, state.stamp_ns)
        if not self._stopped:
            yield from _commands(orders, state.stamp_ns)
        yield from self._report(orders.outcome, state.stamp_ns)
        if self._work.inspection is not None:
            inspection, self._work.inspection = self._work.inspection, None
            yield topics.INSPECTION.of(inspection)

    def _read(self, state: JointState) -> tuple[np.ndarray, float]:
        """Joint angles (6,) and the gap between the fingers."""
        columns = [state.names.index(name) for name in (*self._arm.joints, *self._arm.fingers)]
        positions = state.positions[columns]
        return positions[:6], float(positions[6:].sum())

    def _pair(self, bodies: Bodies, of_wrist: bool) -> Detections | None:
        """The detections of the same picture, unless they were lost on the way."""
        detections = self._unpaired.get(of_wrist)
        return detections if detections and detections.stamp_ns == bodies.stamp_ns else None

    def _report(self, news: Outcome | None, stamp_ns: int) -> Iterable[Output]:
        due = self._hand.busy and stamp_ns - self._reported_ns >= _report_ns
        if self._goal is not None and (news or due):
            yield self._told(news or self._outcome, stamp_ns)

    def _told(self, outcome: Outcome, stamp_ns: int) -> Output:
        assert self._goal is not None
        self._outcome, self._reported_ns = outcome, stamp_ns
        if outcome.state is not TaskState.ACTIVE:
            self._ended.add(self._goal.id)
        return topics.HANDLING_STATUS.of(
            HandlingStatus(
                stamp_ns=stamp_ns,
                goal_id=self._goal.id,
                state=outcome.state,
                failure=outcome.failure,
                reason=outcome.reason,
                holding=self._work.grasp.label if self._work.grasp else "",
            )
        )


def _commands(orders: Orders, stamp_ns: int) -> Iterable[Output]:
    if orders.follow is not None:
        yield topics.ARM_COMMAND.of(orders.follow.command(stamp_ns))
    if orders.opening is not None:
        command = GripperCommand(stamp_ns=stamp_ns, opening=orders.opening)
        yield topics.GRIPPER_COMMAND.of(command)


def _labelled(bodies: Bodies, detections: Detections) -> Sequence[Body]:
    """The bodies of a picture, each of its likeliest class."""
    best = np.argmax(detections.probabilities, axis=1).tolist()
    return bodies_in(bodies, [detections.classes[index] for index in best])
