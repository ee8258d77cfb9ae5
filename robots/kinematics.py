"""Planar motion of a base that turns by driving its sides at different speeds."""

from __future__ import annotations

import math

from robots.spec import BaseGeometry, BaseLimits
from schemas.geometry import Pose2


def moved(world_from_base: Pose2, linear: float, angular: float, duration: float) -> Pose2:
    """Pose after driving an arc at constant speeds [m/s, rad/s] for a duration [s]; exact."""
    turn = angular * duration
    # The chord of an arc of length s and angle a is s sin(a/2) / (a/2), turned by a/2.
    half = turn / 2
    chord = linear * duration * (math.sin(half) / half if abs(half) > 1e-6 else 1.0)
    return world_from_base @ Pose2(chord * math.cos(half), chord * math.sin(half), turn)


def wheel_speeds(base: BaseGeometry, linear: float, angular: float) -> tuple[float, float]:
    """Turning speeds of the left and the right wheels without slip [rad/s]."""
    across = angular * base.track / 2
    return (linear - across) / base.wheel_radius, (linear + across) / base.wheel_radius


def base_speeds(base: BaseGeometry, left: float, right: float) -> tuple[float, float]:
    """Forward speed [m/s] and yaw rate [rad/s] from wheel speeds; inverse of `wheel_speeds`."""
    radius = base.wheel_radius
    return radius * (left + right) / 2, radius * (right - left) / base.track


def limited(limits: BaseLimits, linear: float, angular: float) -> tuple[float, float]:
    """The speeds cut to what the base may do; the path's curvature is kept.

    Values that are not numbers count as zero: a broken planner must not move the robot.
    """
    if not (math.isfinite(linear) and math.isfinite(angular)):
        return 0.0, 0.0
    excess = max(abs(linear) / limits.linear_speed, abs(angular) / limits.angular_speed, 1.0)
    return linear / excess, angular / excess


def ramped(current: float, target: float, rate: float, duration: float) -> float:
    """`current` moved towards `target` by at most `rate` a second."""
    step = rate * duration
    return current + min(max(target - current, -step), step)
