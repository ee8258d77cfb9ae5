"""Carries out one task at a time, a step with every reading of the joints.

A step ends as it should, or the task does: a joint that does not follow, a base that moves, a thing
that is lost from the gripper, a stop. Then the arm is sent nothing more, and so it holds where it
is; the fingers keep what they were told last. Nothing is thrown.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2, wrap_angle
from schemas.task import HandlingFailure, TaskState
from services.manipulation.errors import RefusalError
from services.manipulation.following import Follower, Progress
from services.manipulation.holding import is_held
from services.manipulation.workspace import (
    SETTLE_NS,
    Grip,
    Move,
    Plan,
    Step,
    Steps,
    Watch,
    Workspace,
)

PLANNING_S = 0.5
"""So long planning may take [s]. A motion begins so long after it was planned by the stamps of the
joints: on a robot most of that has passed by then, and modelled time passes alike."""
_grip_s = (0.4, 2.5)
"""After which the fingers may be at rest, and when they are taken to be [s]."""
_resting = 0.004
"""Between two readings fingers at rest move less [m]."""
_watch_s = 2.0
"""So long a picture is waited for [s]."""
_still, _rest_s = 0.003, 0.3
"""Joints that turn less than this from one reading to the next, for so long, are at rest; only from
there can a motion begin [rad], [s]."""
_moved_m, _moved_rad = 0.08, 0.06
"""More than this the base must not move while the arm works [m], [rad]."""


@dataclass(frozen=True)
class Outcome:
    """How a task stands."""

    state: TaskState
    failure: HandlingFailure | None
    reason: str


@dataclass(frozen=True)
class Orders:
    """What one reading of the joints leads to."""

    follow: Follower | None = None
    """The motion that is to be sent on."""
    opening: float | None = None
    """Gap to command [m]."""
    outcome: Outcome | None = None
    """The task's, if it is new."""


class Hand:
    """The arm and its gripper at work.

    Args:
        work: what the arm knows; the fields are updated by whoever hears of them.
    """

    def __init__(self, work: Workspace) -> None:
        self.work = work
        self._steps: Steps | None = None
        self._step: Step | None = None
        self._since_ns = 0
        self._gap = 0.0
        self._turned_ns = 0
        self._follower: Follower | None = None
        self._stood: Pose2 | None = None

    @property
    def busy(self) -> bool:
        """Whether a task is under way."""
        return self._steps is not None

    def begin(self, task: Callable[[], Steps]) -> None:
        """Begin a task; it goes on with the next reading of the joints."""
        self.drop()
        self._steps, self._stood = task(), self.work.odom_from_base

    def drop(self) -> None:
        """Let the task be; the arm holds."""
        if self._steps:
            self._steps.close()
        self._steps = self._step = self._follower = None

    def read(self, joints: Floats, gap: float, stamp_ns: int) -> Orders:
        """Go on, with where joints (6,) and fingers are [rad], [m]."""
        work, self._gap = self.work, self.work.gap
        if np.abs(joints - work.joints).max() > _still:
            self._turned_ns = stamp_ns
        work.joints, work.gap, work.stamp_ns = joints, gap, stamp_ns
        if work.grasp and self._is_lost():
            label, work.grasp = work.grasp.label, None
            return self._end(RefusalError(HandlingFailure.DROPPED, f"the {label} fell"))
        if self._steps is None:
            return Orders()
        try:
            return self._go_on(self._steps)
        except RefusalError as refusal:
            return self._end(refusal)

    def _go_on(self, steps: Steps) -> Orders:
        self._require_still()
        if self._step is None and self.work.stamp_ns - self._turned_ns < _rest_s * 1e9:
            return Orders()  # It still comes to rest from what was broken off.
        if self._step is not None and not self._is_done(self._step):
            return Orders(self._follower)
        try:
            step = self._step = next(steps)
        except StopIteration as stop:
            self.drop()
            return Orders(outcome=Outcome(TaskState.SUCCEEDED, None, str(stop.value)))
        return self._enter(step)

    def _enter(self, step: Step) -> Orders:
        self._since_ns, self._follower = self.work.stamp_ns, None
        doing = Outcome(TaskState.ACTIVE, None, step.doing)
        if isinstance(step, Move):
            # A restarted process must not send a motion of an id that the driver knows.
            name = f"motion/{self.work.stamp_ns}"
            self._follower = Follower(step.motion, name, self.work.stamp_ns)
        opening = step.opening if isinstance(step, Grip) else None
        return Orders(self._follower, opening, doing)

    def _is_done(self, step: Step) -> bool:
        """Whether it is.

        Raises:
            RefusalError: it will never be.
        """
        waited_s = (self.work.stamp_ns - self._since_ns) / 1e9
        match step:
            case Move():
                return self._has_arrived(step)
            case Plan():
                return waited_s >= PLANNING_S
            case Grip():
                least, most = _grip_s
                still = abs(self.work.gap - self._gap) < _resting
                return waited_s >= most or (still and waited_s >= least)
            case Watch():
                seen = self.work.since(self._since_ns + SETTLE_NS)
                return len(seen) >= step.pictures or waited_s >= _watch_s

    def _has_arrived(self, step: Move) -> bool:
        assert self._follower is not None
        progress = self._follower.watch(self.work.joints, self.work.stamp_ns)
        if progress is Progress.STUCK and not step.to_touch:
            raise RefusalError(HandlingFailure.STUCK, f"the arm does not move: it was {step.doing}")
        return progress is not Progress.MOVING

    def _require_still(self) -> None:
        here, stood = self.work.odom_from_base, self._stood
        assert stood is not None
        moved = math.hypot(here.x - stood.x, here.y - stood.y)
        if moved > _moved_m or abs(wrap_angle(here.yaw - stood.yaw)) > _moved_rad:
            raise RefusalError(
                HandlingFailure.LOST, f"the base moved by {moved:.2f} m while the arm worked"
            )

    def _is_lost(self) -> bool:
        grasp = self.work.grasp
        assert grasp is not None
        gripper = self.work.arm.gripper
        return not is_held(gripper, self.work.gap, grasp.grip, grasp.width)

    def _end(self, refusal: RefusalError) -> Orders:
        self.drop()
        return Orders(outcome=Outcome(TaskState.FAILED, refusal.failure, refusal.reason))
