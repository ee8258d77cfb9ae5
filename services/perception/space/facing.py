"""Which way an object is turned: the yaw at which a box of its size lies best on what is seen.

Every yaw is tried. A point counts for how far it lies from the box's faces, up to a limit, so that
what does not belong to the object does not turn it. Things that look the same from all sides fit
about as well at every yaw, and come out with a large deviation.
"""

import math
from dataclasses import dataclass

import numpy as np

from schemas.arrays import Floats

_tried = 60
_most_points = 300
_farthest = 0.08
"""Distances from the faces count up to this [m]."""
_noise = (0.006, 0.004)
"""Deviation of a point from the faces: always [m], and for each metre of range [m/m]."""
_independent = 12.0
"""Points that speak for themselves; neighbours repeat each other's errors."""


@dataclass(frozen=True)
class Facing:
    """A direction of the longer side, which means the same as the opposite one."""

    yaw: float
    """Base frame, in [-pi/2, pi/2) [rad]."""
    deviation: float
    """[rad]; pi / sqrt(12) where nothing is known."""


def facing_of(points: Floats, center: Floats, size: Floats, distance: float) -> Facing:
    """Yaw of a box with a centre (3,) and a size (3,) length, width, height [m].

    Args:
        points: (P, 3) of the visible side, base frame [m].
        center: base frame [m].
        size: of the upright box.
        distance: from the camera [m].
    """
    step = max(1, len(points) // _most_points)
    yaws = np.linspace(-math.pi / 2, math.pi / 2, _tried, endpoint=False, dtype=np.float64)
    gaps = _gaps(points[::step] - center, yaws, size / 2)
    noise = _noise[0] + _noise[1] * distance
    misfit = np.mean(np.minimum(gaps, _farthest) ** 2, axis=1) / noise**2
    chance = np.exp(-0.5 * _independent * (misfit - misfit.min()))
    chance /= chance.sum()
    # Half a turn is no turn: angles are doubled, so that the circle closes.
    mean = complex(np.sum(chance * np.exp(2j * yaws)))
    best = float(yaws[int(np.argmin(misfit))])
    return Facing(best, _deviation(abs(mean)))


def _gaps(offset: Floats, yaws: Floats, half: Floats) -> Floats:
    """Distance (Y, P) of points (P, 3) about the centre from the faces of the box at each yaw."""
    cosine, sine = np.cos(yaws)[:, None], np.sin(yaws)[:, None]
    u = cosine * offset[:, 0] + sine * offset[:, 1]
    v = -sine * offset[:, 0] + cosine * offset[:, 1]
    beyond = np.stack(
        [
            np.abs(u) - half[0],
            np.abs(v) - half[1],
            np.broadcast_to(np.abs(offset[:, 2]) - half[2], u.shape),
        ]
    )
    outside = np.sqrt(np.square(np.maximum(beyond, 0)).sum(axis=0))
    return outside - np.minimum(beyond.max(axis=0), 0)


def _deviation(resultant: float) -> float:
    """Of a direction without sense, from the mean resultant of its doubled angles."""
    even = math.pi / math.sqrt(12)
    return min(0.5 * math.sqrt(-2 * math.log(min(max(resultant, 1e-9), 1.0))), even)
