"""What wheels can do, and what they cannot: the difference between driving and a jump."""

import math
from dataclasses import dataclass
from enum import Enum, auto

from robots.spec import BaseLimits
from schemas.geometry import Pose2

_speed_margin = 2.0
"""Slip, downhill, and a reading that came between two ticks of the wheels."""
_origin = Pose2(0.0, 0.0, 0.0)
_slack_m = 0.5
_slack_rad = 0.5
"""However little time has passed."""


class Step(Enum):
    """What a reading of dead reckoning is after the last one."""

    DRIVEN = auto()
    DOUBTFUL = auto()
    """Too far off to be driven; nothing confirms it yet."""
    JUMPED = auto()
    """The reading before was doubtful, and this one goes on from there."""


@dataclass(frozen=True)
class Reading:
    """Dead reckoning at a time."""

    stamp_ns: int
    odom_from_base: Pose2


class Wheels:
    """Follows dead reckoning and tells driven ways from jumps.

    Args:
        limits: of the base.
    """

    def __init__(self, limits: BaseLimits) -> None:
        self._limits = limits
        self.last: Reading | None = None
        """The last reading that is believed; the map begins where dead reckoning is zero."""
        self.began: Reading | None = None
        """The first reading after the last jump."""
        self._doubtful: Reading | None = None

    @property
    def here(self) -> Pose2:
        """Dead reckoning as it is believed."""
        return self.last.odom_from_base if self.last else _origin

    def follow(self, reading: Reading) -> Step:
        """Judge a reading. A doubtful one is believed as soon as the next confirms it."""
        if self.agree_with(reading):
            self.last, self._doubtful = reading, None
            return Step.DRIVEN
        doubtful, self._doubtful = self._doubtful, reading
        if doubtful is None or not self._is_way(doubtful, reading):
            return Step.DOUBTFUL
        self.last, self.began, self._doubtful = reading, doubtful, None
        return Step.JUMPED

    def agree_with(self, reading: Reading) -> bool:
        """Whether dead reckoning can be of the same drive, another sensor's too."""
        return self._is_way(self.last or Reading(reading.stamp_ns, _origin), reading)

    def _is_way(self, before: Reading, after: Reading) -> bool:
        step = before.odom_from_base.inverse() @ after.odom_from_base
        seconds = _speed_margin * abs(after.stamp_ns - before.stamp_ns) / 1e9
        way, turn = math.hypot(step.x, step.y), abs(step.yaw)
        return (
            way <= _slack_m + self._limits.linear_speed * seconds
            and turn <= _slack_rad + self._limits.angular_speed * seconds
        )
