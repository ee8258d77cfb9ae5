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
_shift_s = 2.5
"""How far ahead it looks [s]."""
_worthwhile = 0.1
"""Less room is not worth to move for: along a wall there is none to be gained [m]."""
_close = 0.04
"""So near to an obstacle not even rounding lets the base come nearer [m]."""
_rounding = 0.005


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
    obstacles = _in_reach(wanted, obstacles, base, limits)
    if len(obstacles) == 0:
        return wanted
    now = _clearance(obstacles, base)
    # Rounding adds up, step by step, to a touch: near an obstacle there is none.
    needed = min(base.margin, now - _rounding if now > _close else now)
    for share in _shares:
        velocity = Velocity(wanted.linear * share, wanted.angular * share)
        if _clearance_on_the_way(velocity, obstacles, base, limits) >= needed:
            return velocity
    return standstill


def turning(
    wanted: Velocity, obstacles: Floats, base: BaseGeometry, limits: BaseLimits
) -> Velocity:
    """What brings a long base nearer to a turn on the spot that may not fit where it stands.

    In a doorway it first goes straight out, the way that is shorter: a turn that was begun there
    wedges it. One that is wedged turns back until it can go straight.
    """
    if len(obstacles) == 0 or _room(obstacles) >= base.radius + base.margin:
        return allowed(wanted, obstacles, base, limits)
    unwound = Velocity(0.0, -wanted.angular)
    steps = (allowed(one, obstacles, base, limits) for one in (wanted, unwound))
    ways = (towards_room(obstacles, base, limits), *steps)
    return next((way for way in ways if way != standstill), standstill)


def towards_room(obstacles: Floats, base: BaseGeometry, limits: BaseLimits) -> Velocity:
    """Straight on or straight back to where there is more room to turn; standstill if neither.

    Args:
        obstacles: points (N, 2), base frame, at least one [m].
        base: footprint.
        limits: accelerations.
    """
    best, most = standstill, _room(obstacles) + _worthwhile
    for speed in (_shift, -_shift):
        room = _room(_seen_after(Velocity(speed, 0.0), _shift_s, obstacles))
        velocity = allowed(Velocity(speed, 0.0), obstacles, base, limits)
        if room > most and velocity != standstill:
            best, most = velocity, room
    return best


def _room(obstacles: Floats) -> float:
    """From the middle of the base to the nearest of the points (N, 2) [m]."""
    return float(np.hypot(*obstacles.T).min())


def _in_reach(
    velocity: Velocity, obstacles: Floats, base: BaseGeometry, limits: BaseLimits
) -> Floats:
    """The points that the base can come near, whichever way it turns until it has come to rest."""
    way = abs(velocity.linear) * _until_rest(velocity, limits)
    return obstacles[np.hypot(*obstacles.T) <= base.radius + base.margin + way]


def _until_rest(velocity: Velocity, limits: BaseLimits) -> float:
    """Time until the base has come to rest from `velocity` [s]."""
    braking = 0.5 * max(
        abs(velocity.linear) / (_braking_share * limits.linear_acceleration),
        abs(velocity.angular) / (_braking_share * limits.angular_acceleration),
    )
    return _reaction + braking


def _clearance_on_the_way(
    velocity: Velocity, obstacles: Floats, base: BaseGeometry, limits: BaseLimits
) -> float:
    """Least clearance until the base has come to rest from `velocity` [m]."""
    times = np.linspace(0.0, _until_rest(velocity, limits), _samples + 1)[1:]
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
