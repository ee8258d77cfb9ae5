"""What moves the robot. Everything here expires or latches."""

from typing import Annotated

from msgspec import Struct

from schemas.arrays import Floats, Shape


class BaseCommand(Struct, frozen=True, kw_only=True):
    """Velocity for the base, obeyed until it expires."""

    stamp_ns: int
    linear: float
    """Forward [m/s]."""
    angular: float
    """Counter-clockwise [rad/s]."""
    valid_ms: int
    """The base stops this long after the command was received unless another came [ms]."""


class ArmCommand(Struct, frozen=True, kw_only=True):
    """A timed motion of the arm, sent again and again for as long as it is meant.

    The arm begins when it first gets a motion of this id; the same id again only prolongs it. When
    no more comes, or at a stop, the arm comes to rest on its way and holds. A motion that breaks
    the arm's limits, or that does not begin where the arm is, is not begun at all.
    """

    stamp_ns: int
    id: str
    """Of the motion."""
    times: Annotated[Floats, Shape("K")]
    """Of each point since the motion began, ascending from 0 [s]."""
    positions: Annotated[Floats, Shape("K J")]
    """Joint angles in the order of the robot's description [rad]."""
    velocities: Annotated[Floats, Shape("K J")]
    """At each point [rad/s]; between points the motion is a cubic."""
    valid_ms: int
    """The arm holds this long after the command was received unless another came [ms]."""


class GripperCommand(Struct, frozen=True, kw_only=True):
    """How far the gripper is to be open. It does not expire: what is held is held on to."""

    stamp_ns: int
    opening: float
    """Gap between the pads; less than a thing is wide means to hold it tight [m]."""


class StopLatch(Struct, frozen=True, kw_only=True):
    """Latched stop of all motion. Only a later message with `stopped` False releases it."""

    stamp_ns: int
    stopped: bool
    source: str


class DriverCheckpoint(Struct, frozen=True, kw_only=True):
    """What a driver needs to go on where it was after its process died."""

    stamp_ns: int
    state: bytes
    """Opaque to everybody but the driver that wrote it."""
