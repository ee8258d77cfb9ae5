"""What moves the robot. Everything here expires or latches."""

from msgspec import Struct


class BaseCommand(Struct, frozen=True, kw_only=True):
    """Velocity for the base, obeyed until it expires."""

    stamp_ns: int
    linear: float
    """Forward [m/s]."""
    angular: float
    """Counter-clockwise [rad/s]."""
    valid_ms: int
    """The base stops this long after the command was received unless another came [ms]."""


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
