"""From a way to a motion: as fast along it as speeds and accelerations of the joints allow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from robots.arm import ArmLimits
from schemas.arrays import Floats

_spacing = 0.03
"""Between points at which the speed is chosen [rad of the joint that turns most]."""
_still = 1e-6
"""Less than this is no motion [rad]."""
_share = 0.85
"""Of the limits, so that the driver need not slow the motion down."""
_bend_share = 0.6
"""Of the acceleration that may go into bends; the rest is left for gaining and losing speed."""


@dataclass(frozen=True)
class Motion:
    """A timed way of the arm, at rest at both ends. Between points it is a cubic."""

    times: Floats
    """(K,) from 0 [s]."""
    positions: Floats
    """(K, 6) [rad]"""
    velocities: Floats
    """(K, 6) [rad/s]"""

    @property
    def duration(self) -> float:
        """Of the whole motion [s]."""
        return float(self.times[-1])


def timed(limits: ArmLimits, corners: Floats, pace: float = 1.0) -> Motion:
    """The fastest motion along a way that keeps to the limits.

    The squared speed along the way is first bounded everywhere by joint speeds and bends, then
    lowered until every point can be reached from the one before and braked for in the one after.

    Args:
        limits: of the joints.
        corners: of the way (N, 6), two or more [rad].
        pace: share of the limits to use.
    """
    if np.ptp(corners, axis=0).max() < _still:
        return Motion(np.array([0.0, _spacing]), corners[[0, -1]], np.zeros((2, 6)))
    way, slope, bend, grid = _smooth(corners)
    speed, acceleration = (np.array(x) * _share * pace for x in (limits.speed, limits.acceleration))
    with np.errstate(divide="ignore"):
        highest = ((speed / np.abs(slope)) ** 2).min(axis=1)
        highest = np.minimum(highest, (_bend_share * acceleration / np.abs(bend)).min(axis=1))
    highest[[0, -1]] = 0.0
    squares = _reachable(highest, slope, bend, grid, acceleration)
    squares = _reachable(squares[::-1], slope[::-1], bend[::-1], grid[::-1], acceleration)[::-1]
    paces = np.sqrt(squares)
    # At constant acceleration the mean speed of a piece is the mean of its ends'.
    spans = np.diff(grid) / np.maximum((paces[1:] + paces[:-1]) / 2, 1e-9)
    return Motion(np.r_[0.0, np.cumsum(spans)], way, slope * paces[:, None])


def _smooth(corners: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Points, first and second derivatives (K, 6) along the way, and its length at them (K,)."""
    steps = np.abs(np.diff(corners, axis=0)).max(axis=1)
    kept = np.r_[True, steps > _still]
    along = np.r_[0.0, np.cumsum(steps[kept[1:]])]
    curve = PchipInterpolator(along, corners[kept])
    grid = np.linspace(0.0, along[-1], max(8, int(np.ceil(along[-1] / _spacing)) + 1))
    bend = np.asarray(curve(grid, 2))
    # Its second derivative jumps at corners: both sides of a jump have to be kept to.
    bend = np.maximum(np.abs(bend), np.abs(np.asarray(curve(np.maximum(grid - 1e-6, 0), 2))))
    return np.asarray(curve(grid)), np.asarray(curve(grid, 1)), bend, grid


def _reachable(
    highest: Floats, slope: Floats, bend: Floats, grid: Floats, acceleration: Floats
) -> Floats:
    """Squared speeds that follow from one another with what acceleration the bends leave."""
    squares = highest.copy()
    spans = np.abs(np.diff(grid))
    for k in range(1, len(squares)):
        left = acceleration - bend[k - 1] * squares[k - 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = np.nanmin(np.where(slope[k - 1] == 0, np.inf, left / np.abs(slope[k - 1])))
        squares[k] = min(squares[k], squares[k - 1] + 2 * max(gain, 0.0) * spans[k - 1])
    return squares
