"""Drives the reference path without stopping: the best that this body could have done."""

from collections.abc import Callable, Iterable

import shapely

from robots.spec import RobotSpec
from schemas import topics
from schemas.arrays import Floats
from schemas.geometry import Pose2
from schemas.language import Annotations
from schemas.motion import BaseCommand
from schemas.sensing import Odometry
from schemas.task import Failure, InstructionStatus, TaskState
from schemas.topics import Handlers, Output
from services.navigation.follower import Velocity, follow, nearest_index, standstill

PathTo = Callable[[Annotations], Floats | None]
"""Corners (N, 2) of the way to what is meant, world frame [m]; None where nothing is meant."""

_speed_share = 0.8
"""As fast as the policy lets the robot go."""
_step = 0.1
_valid_ms = 250


class ReferenceDriverNode:
    """Takes the place of the policy. Navigation gets no goal and leaves the base alone.

    Args:
        spec: limits of the base.
        world_from_base: the robot's true pose now.
        path_to: the way to drive.
    """

    def __init__(
        self, spec: RobotSpec, world_from_base: Callable[[], Pose2], path_to: PathTo
    ) -> None:
        self._limits = spec.limits
        self._world_from_base, self._path_to = world_from_base, path_to
        self._heard: Annotations | None = None
        self._path: Floats | None = None

    def handlers(self) -> Handlers:
        """The odometry sets the pace."""
        return {topics.ODOMETRY: self.on_odometry, topics.ANNOTATIONS: self.on_annotations}

    def on_annotations(self, annotations: Annotations) -> Iterable[Output]:
        """Plan once, when the instruction is understood."""
        if self._heard is not None:
            return
        self._heard = annotations
        corners = self._path_to(annotations)
        if corners is None:
            yield self._status(annotations.stamp_ns, Failure.NOT_UNDERSTOOD, "nothing is meant")
            return
        self._path = _dense(corners)
        yield self._status(annotations.stamp_ns, None, "driving the reference path")

    def on_odometry(self, odometry: Odometry) -> Iterable[Output]:
        """One control step, with the true pose."""
        if self._path is None:
            return
        pose = self._world_from_base()
        rest = self._path[nearest_index(pose, self._path) :]
        if len(rest) == 1:
            self._path = None
            yield _command(standstill, odometry.stamp_ns)
            yield self._status(odometry.stamp_ns, None, "standing at it", TaskState.SUCCEEDED)
            return
        speed = _speed_share * self._limits.linear_speed
        yield _command(follow(pose, rest, self._limits, speed), odometry.stamp_ns)

    def _status(
        self,
        stamp_ns: int,
        failure: Failure | None,
        reason: str,
        state: TaskState = TaskState.ACTIVE,
    ) -> Output:
        assert self._heard is not None
        return topics.INSTRUCTION_STATUS.of(
            InstructionStatus(
                stamp_ns=stamp_ns,
                instruction_id=self._heard.instruction_id,
                text=self._heard.text,
                state=TaskState.FAILED if failure else state,
                failure=failure,
                reason=reason,
                started_ns=self._heard.stamp_ns,
                decisions=1,
            )
        )


def _dense(corners: Floats) -> Floats:
    return shapely.get_coordinates(shapely.segmentize(shapely.linestrings(corners), _step))


def _command(velocity: Velocity, stamp_ns: int) -> Output:
    return topics.BASE_COMMAND.of(
        BaseCommand(
            stamp_ns=stamp_ns,
            linear=velocity.linear,
            angular=velocity.angular,
            valid_ms=_valid_ms,
        )
    )
