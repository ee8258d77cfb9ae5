"""The simulated robot as a process: what a real robot's node would do with its driver."""

from collections.abc import Iterable
from typing import Any, cast

import msgspec
import numpy as np

from robots.catalogue import get_robot
from robots.driver import ArmDriver, Reading, RobotDriver
from schemas import topics
from schemas.errors import MissingComponentError, UserError
from schemas.health import Tick
from schemas.motion import (
    ArmCommand,
    BaseCommand,
    DriverCheckpoint,
    GripperCommand,
    StopLatch,
)
from schemas.run import RunConfig
from schemas.sensing import JointState, LaserScan, Odometry, RgbdFrame, WristFrame
from schemas.topics import Handlers, Output, Topic
from sim import vulkan
from sim.world import make_world

_topic_of: dict[type[Reading], Topic[Any]] = {
    Odometry: topics.ODOMETRY,
    JointState: topics.JOINT_STATE,
    LaserScan: topics.SCAN,
    RgbdFrame: topics.RGBD,
    WristFrame: topics.WRIST_RGBD,
}
DRAWN = ("husky", "husky_ur5")
"""Robots whose looks and camera pictures the simulator can draw."""
_longest_step_ns = 100_000_000
_checkpoint_period_ns = 200_000_000


class RobotNode:
    """Steps the driver with every tick.

    The driver counts its own time from zero; here it is moved to the ticks' time. A machine too
    slow to simulate in real time gets a slow robot, not one that jumps to catch up.
    """

    def __init__(
        self, run: RunConfig, rng: np.random.Generator, driver: RobotDriver | None = None
    ) -> None:
        del rng  # The driver draws from the run's seed, so that a restart repeats its noise.
        self._driver = driver or open_driver(run)
        self._offset_ns: int | None = None
        self._checkpoint_due_ns = 0

    def handlers(self) -> Handlers:
        """Time, velocities and the stop."""
        return {
            topics.STOP: self.on_stop,
            topics.BASE_COMMAND: self.on_command,
            topics.ARM_COMMAND: self.on_arm,
            topics.GRIPPER_COMMAND: self.on_gripper,
            topics.TICK: self.on_tick,
        }

    def resume(self) -> Handlers:
        """The robot stands where it stood when its process died."""
        return {topics.DRIVER_CHECKPOINT: self.on_own_checkpoint}

    def on_own_checkpoint(self, checkpoint: DriverCheckpoint) -> Iterable[Output]:
        """Go on from there."""
        self._driver.restore(checkpoint.state)
        return ()

    def on_stop(self, latch: StopLatch) -> Iterable[Output]:
        """Stop at once, or release."""
        self._driver.latch_stop(latch.stopped)
        return ()

    def on_command(self, command: BaseCommand) -> Iterable[Output]:
        """Take a velocity."""
        self._driver.command(command)
        return ()

    def on_arm(self, command: ArmCommand) -> Iterable[Output]:
        """Take a motion of the arm."""
        _with_arm(self._driver).command_arm(command)
        return ()

    def on_gripper(self, command: GripperCommand) -> Iterable[Output]:
        """Take a gap between the fingers."""
        _with_arm(self._driver).command_gripper(command)
        return ()

    def on_tick(self, tick: Tick) -> Iterable[Output]:
        """Advance to now and tell what the sensors read."""
        if self._offset_ns is None:
            self._offset_ns = tick.stamp_ns - self._driver.stamp_ns
        behind_ns = tick.stamp_ns - self._offset_ns - self._driver.stamp_ns
        self._offset_ns += max(0, behind_ns - _longest_step_ns)
        for reading in self._driver.step(tick.stamp_ns - self._offset_ns):
            stamp_ns = reading.stamp_ns + self._offset_ns
            stamped = msgspec.structs.replace(reading, stamp_ns=stamp_ns)
            yield _topic_of[type(reading)].of(stamped)
        if tick.stamp_ns >= self._checkpoint_due_ns:
            self._checkpoint_due_ns = tick.stamp_ns + _checkpoint_period_ns
            state = self._driver.checkpoint()
            yield topics.DRIVER_CHECKPOINT.of(DriverCheckpoint(stamp_ns=tick.stamp_ns, state=state))

    def close(self) -> None:
        """Let the simulator go."""
        self._driver.close()

    @property
    def driver(self) -> RobotDriver:
        """The hardware, for evaluation."""
        return self._driver


def _with_arm(driver: RobotDriver) -> ArmDriver:
    if driver.spec.arm is None:
        raise UserError(f"robot {driver.spec.name!r} has no arm to command")
    return cast(ArmDriver, driver)


def open_driver(run: RunConfig) -> RobotDriver:
    """The simulated robot of a run, with its camera.

    Raises:
        MissingComponentError: its pictures cannot be drawn, or there is no Vulkan device to draw
            them with.
        WorldError: no such world.
    """
    require_pictures(run.robot)
    vulkan.activate()
    # sapien must not be imported before the driver it is to draw with is in place.
    from sim.driver import SapienDriver  # noqa: PLC0415

    world = make_world(run.world, run.seed)
    try:
        return SapienDriver(get_robot(run.robot), world, run.seed)
    except RuntimeError as error:
        raise MissingComponentError(
            f"no Vulkan device to draw with ({error}); mend it with 'incognita doctor --fix'"
        ) from error


def require_pictures(robot: str) -> None:
    """Make sure that a robot's cameras can be simulated.

    Raises:
        MissingComponentError: they cannot; the message says what works without.
    """
    if robot not in DRAWN:
        raise MissingComponentError(
            f"the cameras of {robot!r} are not simulated yet; use --robot {' or '.join(DRAWN)}, or "
            f"'incognita episode --robot {robot}', where perception is modelled"
        )
