"""The last look before moving: what the newest scan allows of a velocity."""

import numpy as np

from robots.spec import BaseGeometry, BaseLimits
from schemas.arrays import Floats
from schemas.sensing import LaserScan
from services.navigation.follower import Velocity, standstill

_reaction = 0.35
"""From a scan to its effect on the wheels [s]."""
_braking_share = 0.5
"""Share of the acceleration limit trusted for an emergency stop."""
_shares = (1.0, 0.75, 0.5, 0.3, 0.15)
_samples = 8
_shift = 0.2
"""Speed at which a base that cannot turn looks for room [m/s]."""
_shift_s = 1.0


def obstacles_base(scan: LaserScan) -> Floats:
    """End points of the beams that hit something, base frame, shape (N, 2) [m]."""
    beams = np.flatnonzero((scan.ranges > 0) & (scan.ranges < scan.range_max))
    angles = scan.angle_min + scan.angle_increment * beams
    ranges = scan.ranges[beams].astype(np.float64)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return scan.base_from_laser.apply(ranges[:, None] * directions)


def allowed(
    wanted: Velocity, obstacles: Floats, base: BaseGeometry, limits: BaseLimits
) -> Velocity:
    """The fastest share of `wanted` after which the base can still stop clear of obstacles.

    Something nearer than the margin forbids to come nearer still; it does not forbid to leave.

    Args:
        wanted: velocity to check.
        obstacles: points (N, 2), base frame [m].
        base: footprint.
        limits: accelerations.
    """
    if len(obstacles) == 0:
        return wanted
    needed = min(base.margin, _clearance(obstacles, base) - 0.005)
    for share in _shares:
        velocity = Velocity(wanted.linear * share, wanted.angular * share)
        if _clearance_on_the_way(velocity, obstacles, base, limits) >= needed:
            return velocity
    return standstill


def towards_room(obstacles: Floats, base: BaseGeometry, limits: BaseLimits) -> Velocity:
    """Straight on or straight back to where there is more room to turn; standstill if neither.

    A long base in a doorway gets out of it the way that is shorter, and turns there.

    Args:
        obstacles: points (N, 2), base frame, at least one [m].
        base: footprint.
        limits: accelerations.
    """
    best, most = standstill, float(np.hypot(*obstacles.T).min())
    for speed in (_shift, -_shift):
        velocity = allowed(Velocity(speed, 0.0), obstacles, base, limits)
        moved = _seen_after(velocity, _shift_s, obstacles)
        room = float(np.hypot(*moved.T).min())
        if room > most:
            best, most = velocity, room
    return best


def _clearance_on_the_way(
    velocity: Velocity, obstacles: Floats, base: BaseGeometry, limits: BaseLimits
) -> float:
    """Least clearance until the base has come to rest from `velocity` [m]."""
    until_rest = 0.5 * max(
        abs(velocity.linear) / (_braking_share * limits.linear_acceleration),
        abs(velocity.angular) / (_braking_share * limits.angular_acceleration),
    )
    times = np.linspace(0.0, _reaction + until_rest, _samples + 1)[1:]
    return min(_clearance(_seen_after(velocity, t, obstacles), base) for t in times.tolist())


def _seen_after(velocity: Velocity, time: float, obstacles: Floats) -> Floats:
    """The points in the base frame after driving an arc for `time` [s]."""
    yaw = velocity.angular * time
    # Chord of the arc; exact for a circle, and free of a division by a small turn.
    chord = velocity.linear * time * np.sinc(yaw / (2 * np.pi))
    moved = obstacles - chord * np.array([np.cos(yaw / 2), np.sin(yaw / 2)])
    c, s = np.cos(yaw), np.sin(yaw)
    return moved @ np.array([[c, -s], [s, c]])


def _clearance(points: Floats, base: BaseGeometry) -> float:
    """Distance from the footprint rectangle to the nearest point, negative inside [m]."""
    outside = np.abs(points) - 0.5 * np.array([base.length, base.width])
    apart = np.hypot(*np.maximum(outside, 0.0).T) + np.minimum(outside.max(axis=1), 0.0)
    return float(apart.min())
