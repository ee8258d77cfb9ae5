"""How uncertain dead reckoning has become since a given moment."""

import math
from dataclasses import dataclass

from schemas.geometry import Pose2

_slack = (1e-5, 1e-5, 1e-6)
"""So that an edge of a robot that stood still has full rank."""


@dataclass(frozen=True)
class OdometryNoise:
    """Growth of the variances of dead reckoning, as `Odometry` states them."""

    variance_per_metre: float
    """[m^2/m]"""
    variance_per_radian: float
    """[rad^2/rad]"""


class Odometer:
    """Adds up way and turn: going to and fro leaves more error than the distance tells."""

    def __init__(self, odom_from_base: Pose2) -> None:
        self.restart(odom_from_base)

    def restart(self, odom_from_base: Pose2) -> None:
        """Begin again at zero."""
        self._start = self._last = odom_from_base
        self._position_variance = 0.0
        self._yaw_variance = 0.0

    def move(self, odom_from_base: Pose2, noise: OdometryNoise) -> None:
        """Add one reading."""
        step = self._last.inverse() @ odom_from_base
        self._position_variance += noise.variance_per_metre * math.hypot(step.x, step.y)
        self._yaw_variance += noise.variance_per_radian * abs(step.yaw)
        self._last = odom_from_base

    def variances(self, odom_from_base: Pose2) -> tuple[float, float, float]:
        """Of x, y [m^2] and yaw [rad^2] between the start and here."""
        step = self._start.inverse() @ odom_from_base
        # Yaw errors on the way shift the end sideways: a third is their mean over a straight way.
        sideways = self._yaw_variance * (step.x**2 + step.y**2) / 3
        return (
            self._position_variance + sideways + _slack[0],
            self._position_variance + sideways + _slack[1],
            self._yaw_variance + _slack[2],
        )
