"""Imperfect motion as explicit, seeded models instead of accidents of the physics engine.

PhysX cannot let a rolling skid-steered base yaw, so the base follows its speeds exactly and the
errors that a real one makes are put in here. Draws depend on the seed and the tick alone: nothing
has to be remembered for a run to be continued identically.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from robots.spec import OdometryNoise
from schemas.geometry import Pose2

STREAMS = ("slip", "odometry", "laser", "camera", "wrist")
SLIP_DEVIATION = 0.02
"""Relative deviation of the true speed from the wheels' speed."""
SLIP_TIME = 1.0
"""How long a slip lasts [s]."""


def generator(seed: int, stream: str, tick: int) -> Generator:
    """The random numbers of one stream at one tick."""
    return np.random.default_rng([seed, STREAMS.index(stream), tick])


def next_slip(slip: tuple[float, float], rng: Generator, duration: float) -> tuple[float, float]:
    """Relative errors of forward speed and yaw rate, one step of a mean-reverting walk."""
    keep = math.exp(-duration / SLIP_TIME)
    spread = SLIP_DEVIATION * math.sqrt(1 - keep**2)
    forward, turning = (keep * value + spread * rng.normal() for value in slip)
    return forward, turning


def measured_motion(true_motion: Pose2, noise: OdometryNoise, rng: Generator) -> Pose2:
    """What dead reckoning makes of a small motion, base_from_next_base.

    Variances grow with the distance driven and the angle turned, so a robot that stands still does
    not drift.
    """
    metres = math.hypot(true_motion.x, true_motion.y)
    position = math.sqrt(noise.variance_per_metre * metres)
    angle = math.sqrt(noise.variance_per_radian * abs(true_motion.yaw))
    dx, dy, dyaw = rng.normal(size=3).tolist()
    return Pose2(
        true_motion.x + position * dx, true_motion.y + position * dy, true_motion.yaw + angle * dyaw
    )
