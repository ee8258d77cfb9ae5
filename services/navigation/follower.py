"""Velocities that keep the base on a path (pure pursuit) and turn it to a heading."""

import math
from dataclasses import dataclass

import numpy as np

from robots.spec import BaseLimits
from schemas.arrays import Floats
from schemas.geometry import Pose2, wrap_angle

_lookahead_still = 0.5
_lookahead_per_speed = 0.6
_turn_first_above = 0.7
"""Heading error at which the base turns on the spot before it drives [rad]."""
_braking_share = 0.25
"""Share of the acceleration limit used to come to rest at the end, so that slip is no harm."""
_creep = 0.08
"""Slowest speed that still moves the base [m/s]."""
_turn_gain = 2.0
_turn_creep = 0.2
"""[rad/s]"""
_turn_speed_share = 0.7
"""The camera needs pictures that are not smeared."""


@dataclass(frozen=True)
class Velocity:
    """What the base should do now."""

    linear: float
    """[m/s]"""
    angular: float
    """[rad/s]"""


standstill = Velocity(0.0, 0.0)


def follow(map_from_base: Pose2, path: Floats, limits: BaseLimits, speed_limit: float) -> Velocity:
    """Velocity towards a point of `path` (N, 2) some way ahead, slower near its end."""
    speed = min(speed_limit, limits.linear_speed)
    ahead = path[nearest_index(map_from_base, path) :]
    remaining = length_of(ahead)
    lookahead = _lookahead_still + _lookahead_per_speed * speed
    x, y = map_from_base.inverse().apply(_point_at(ahead, lookahead)).tolist()
    bearing = math.atan2(y, x)
    if abs(bearing) > _turn_first_above:
        return turn(bearing, limits)
    braking = math.sqrt(2 * _braking_share * limits.linear_acceleration * remaining)
    linear = max(_creep, min(speed, braking) * math.cos(bearing) ** 2)
    curvature = 2 * y / max(x * x + y * y, 0.01)
    return _limited(linear, linear * curvature, limits)


def turn(error: float, limits: BaseLimits) -> Velocity:
    """Turn on the spot by `error` [rad], slower as it gets small."""
    fastest = _turn_speed_share * limits.angular_speed
    # The speed from which the base can still come to rest, so that it does not swing past.
    braking = math.sqrt(2 * _braking_share * limits.angular_acceleration * abs(error))
    rate = max(_turn_creep, min(fastest, braking, _turn_gain * abs(error)))
    return Velocity(0.0, math.copysign(rate, wrap_angle(error)))


def nearest_index(map_from_base: Pose2, path: Floats) -> int:
    """Index of the path point nearest to the base."""
    return int(np.argmin(np.hypot(path[:, 0] - map_from_base.x, path[:, 1] - map_from_base.y)))


def length_of(path: Floats) -> float:
    """Length of a polyline (N, 2) [m]."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def _point_at(path: Floats, distance: float) -> Floats:
    """The point `distance` along a polyline, its end at most."""
    travelled = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    return np.array([np.interp(distance, travelled, path[:, axis]) for axis in (0, 1)])


def _limited(linear: float, angular: float, limits: BaseLimits) -> Velocity:
    """Keep the curvature where the turn would be too fast."""
    fastest = _turn_speed_share * limits.angular_speed
    scale = min(1.0, fastest / max(abs(angular), 1e-9))
    return Velocity(linear * scale, angular * scale)
