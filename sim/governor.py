"""The last word before the wheels: expiry, stop latch, speed and acceleration limits."""

from __future__ import annotations

from robots.kinematics import limited, ramped
from robots.spec import BaseLimits
from schemas.motion import BaseCommand


class BaseGovernor:
    """Turns the stream of commands into speeds that the base may have."""

    def __init__(self, limits: BaseLimits) -> None:
        self._limits = limits
        self._target = (0.0, 0.0)
        self._expires_ns = 0
        self.linear = 0.0
        self.angular = 0.0
        self.stopped = False

    def take(self, command: BaseCommand, now_ns: int) -> None:
        """Obey a command from now on until it expires or another comes."""
        self._target = limited(self._limits, command.linear, command.angular)
        valid_s = min(max(command.valid_ms, 0) / 1e3, self._limits.command_expiry_s)
        self._expires_ns = now_ns + round(valid_s * 1e9)

    def latch(self, stopped: bool) -> None:
        """Stop until released; a release does not bring an old command back."""
        self.stopped = stopped
        self._target, self._expires_ns = (0.0, 0.0), 0

    def resume_at(self, linear: float, angular: float) -> None:
        """Go on from these speeds [m/s, rad/s], with no command."""
        self.linear, self.angular = linear, angular

    def advance(self, now_ns: int, duration: float) -> tuple[float, float]:
        """Speeds [m/s, rad/s] for the next `duration` seconds."""
        obeyed = not self.stopped and now_ns < self._expires_ns
        linear, angular = self._target if obeyed else (0.0, 0.0)
        limits = self._limits
        self.linear = ramped(self.linear, linear, limits.linear_acceleration, duration)
        self.angular = ramped(self.angular, angular, limits.angular_acceleration, duration)
        return self.linear, self.angular
