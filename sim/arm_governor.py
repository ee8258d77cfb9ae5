"""The last word before the arm's motors: what may begin, how fast it goes, and when it holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robots.arm import ArmLimits, GripperSpec
from schemas.arrays import Floats
from schemas.motion import ArmCommand, GripperCommand

_settle_s = 0.3
"""In which the arm slides from where it was to where its motion begins [s]."""
_resting = 0.05
"""Slower than this the arm may begin another motion [rad/s]."""


@dataclass(frozen=True)
class Setpoint:
    """Where the joints are to be now."""

    positions: Floats
    """(J,) [rad]"""
    velocities: Floats
    """(J,) [rad/s]"""


@dataclass
class _Motion:
    """A motion under way."""

    command: ArmCommand
    offset: Floats
    """From its beginning to where the arm was [rad]."""
    rate: float
    """At which its time may pass at most; 1 is as it was commanded."""
    time_s: float = 0.0


class ArmGovernor:
    """Turns commanded motions into setpoints that the arm may have.

    A motion is never bent: it is refused, or slowed down as a whole. Stopping, too, is slowing down
    on the way, which is as free of collisions as the rest of it.

    Args:
        limits: what to keep to.
        resting: where the joints are (J,) [rad].
    """

    def __init__(self, limits: ArmLimits, resting: Floats) -> None:
        self._limits = limits
        self._motion: _Motion | None = None
        self._expires_ns = 0
        self._rate = 0.0
        self.stopped = False
        self.setpoint = Setpoint(resting, np.zeros_like(resting))

    def take(self, command: ArmCommand, now_ns: int) -> None:
        """Begin a motion or go on with it; while stopped nothing is taken."""
        if self.stopped:
            return
        if self._motion is None or self._motion.command.id != command.id:
            if not self._may_begin(command):
                return
            offset = self.setpoint.positions - command.positions[0]
            self._motion = _Motion(command, offset, _rate(self._limits, command))
            self._rate = self._motion.rate
        valid_s = min(max(command.valid_ms, 0) / 1e3, self._limits.command_expiry_s)
        self._expires_ns = now_ns + round(valid_s * 1e9)

    def latch(self, stopped: bool) -> None:
        """Hold until released; a release does not bring the old motion back."""
        self.stopped, self._expires_ns = stopped, 0

    def advance(self, now_ns: int, duration: float) -> Setpoint:
        """Where the joints are to be `duration` seconds later."""
        motion = self._motion
        if motion is None:
            return self.setpoint
        obeyed = not self.stopped and now_ns < self._expires_ns
        step = duration / self._limits.stop_s
        self._rate = min(self._rate + step, motion.rate) if obeyed else max(self._rate - step, 0.0)
        motion.time_s += self._rate * duration
        self.setpoint = _sample(motion, self._rate)
        if self._rate == 0.0 or motion.time_s >= motion.command.times[-1]:
            self._rest()
        return self.setpoint

    def _rest(self) -> None:
        positions = self.setpoint.positions
        self.setpoint = Setpoint(positions, np.zeros_like(positions))
        if self._motion and self._motion.time_s < self._motion.command.times[-1]:
            # What was broken off does not go on by itself when its sender is heard of again.
            self._motion.rate = 0.0

    def _may_begin(self, command: ArmCommand) -> bool:
        limits, shape = self._limits, (len(command.times), len(self.setpoint.positions))
        arrays = (command.times, command.positions, command.velocities)
        if command.positions.shape != shape or not all(np.isfinite(a).all() for a in arrays):
            return False
        if shape[0] < 2 or command.times[0] != 0 or (np.diff(command.times) <= 0).any():
            return False
        if (command.positions < limits.low).any() or (command.positions > limits.high).any():
            return False
        gap = np.abs(command.positions[0] - self.setpoint.positions).max()
        moving = np.abs(self.setpoint.velocities).max() > _resting
        return bool(gap <= limits.start_tolerance and not moving)


def _rate(limits: ArmLimits, command: ArmCommand) -> float:
    """How fast the motion may go at most; 1 if it keeps to the limits."""
    spans = np.diff(command.times)[:, None]
    means = np.abs(np.diff(command.positions, axis=0)) / spans
    speed = np.maximum(means.max(axis=0), np.abs(command.velocities).max(axis=0))
    acceleration = (np.abs(np.diff(command.velocities, axis=0)) / spans).max(axis=0)
    excess = [speed / limits.speed, np.sqrt(acceleration / limits.acceleration)]
    return 1.0 / max(1.0, float(np.max(excess)))


def _sample(motion: _Motion, rate: float) -> Setpoint:
    """The cubic between two points of the motion."""
    command = motion.command
    time = min(motion.time_s, float(command.times[-1]))
    after = int(np.clip(np.searchsorted(command.times, time, "right"), 1, len(command.times) - 1))
    span = command.times[after] - command.times[after - 1]
    u = (time - command.times[after - 1]) / span
    ends, slopes = command.positions[after - 1 :][:2], command.velocities[after - 1 :][:2] * span
    place = np.array([2 * u**3 - 3 * u**2 + 1, 3 * u**2 - 2 * u**3])
    lean = np.array([u**3 - 2 * u**2 + u, u**3 - u**2])
    pace = np.array([6 * u**2 - 6 * u, 6 * u - 6 * u**2]) @ ends
    pace = (pace + np.array([3 * u**2 - 4 * u + 1, 3 * u**2 - 2 * u]) @ slopes) / span
    left = motion.offset * max(0.0, 1 - motion.time_s / _settle_s)
    return Setpoint(place @ ends + lean @ slopes + left, pace * rate)


class GripperGovernor:
    """Moves the gap between the fingers towards what was commanded, and keeps it at a stop."""

    def __init__(self, gripper: GripperSpec, opening: float) -> None:
        self._gripper = gripper
        self._target = opening
        self.opening = opening
        self.stopped = False

    def take(self, command: GripperCommand) -> None:
        """Go for another gap from now on; while stopped nothing is taken."""
        if not self.stopped and np.isfinite(command.opening):
            self._target = float(np.clip(command.opening, 0.0, self._gripper.opening))

    def latch(self, stopped: bool) -> None:
        """Keep the fingers where they are, and the force that they hold with."""
        self.stopped, self._target = stopped, self.opening

    def advance(self, duration: float) -> float:
        """The gap to be had `duration` seconds later [m]."""
        step = self._gripper.speed * duration
        self.opening += float(np.clip(self._target - self.opening, -step, step))
        return self.opening
