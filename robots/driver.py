"""The one interface of the hardware. A simulated robot and a real one both implement it."""

from collections.abc import Iterable
from typing import Protocol

from robots.spec import RobotSpec
from schemas.motion import ArmCommand, BaseCommand, GripperCommand
from schemas.sensing import JointState, LaserScan, Odometry, RgbdFrame

Reading = RgbdFrame | LaserScan | Odometry | JointState


class RobotDriver(Protocol):
    """Moves one robot and reads its sensors. It owns no thread and no clock.

    Limits, expiry and the stop latch are enforced here, last, whatever was commanded.
    """

    @property
    def spec(self) -> RobotSpec:
        """What this robot is."""
        ...

    @property
    def stamp_ns(self) -> int:
        """The hardware's own time."""
        ...

    @property
    def stopped(self) -> bool:
        """Whether the stop is latched."""
        ...

    def command(self, command: BaseCommand) -> None:
        """Take a velocity. It replaces the one before and expires by itself."""
        ...

    def latch_stop(self, stopped: bool) -> None:
        """Stop all motion until released with False."""
        ...

    def step(self, until_ns: int) -> Iterable[Reading]:
        """Advance to a time and return what the sensors read on the way, oldest first."""
        ...

    def checkpoint(self) -> bytes:
        """State to go on from after the process died."""
        ...

    def restore(self, state: bytes) -> None:
        """Go on from a checkpoint.

        Raises:
            ValueError: the bytes are not a checkpoint of this driver.
        """
        ...

    def close(self) -> None:
        """Let go of the hardware."""
        ...


class ArmDriver(RobotDriver, Protocol):
    """A driver that can also move an arm, where its robot has one."""

    def command_arm(self, command: ArmCommand) -> None:
        """Begin a motion, or go on with it. It expires by itself.

        Raises:
            UserError: the robot has no arm.
        """
        ...

    def command_gripper(self, command: GripperCommand) -> None:
        """Open or close the gripper.

        Raises:
            UserError: the robot has no arm.
        """
        ...
