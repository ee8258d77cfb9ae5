"""The pose graph, built here and solved in `backbone`: what a test can count and inspect.

Nodes are robot poses (key x) and objects that were seen (key l). Edges are odometry and sightings,
the structure of the information matrix in Section "Updating the metric map".
"""

import math
from dataclasses import dataclass, field

import gtsam
import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2
from services.mapping.scan_matching import Match

_x, _l = gtsam.symbol_shorthand.X, gtsam.symbol_shorthand.L


@dataclass(frozen=True)
class Motion:
    """Odometry edge between two successive poses."""

    before: int
    after: int
    before_from_after: Pose2
    variances: tuple[float, float, float]
    """Of x, y [m^2] and yaw [rad^2]."""
    map_from_after: Pose2
    """Where to start the solution."""


@dataclass(frozen=True)
class Sighting:
    """One object as seen from one pose."""

    pose: int
    object: int
    point: Floats
    """(2,), frame of the pose [m]."""
    covariance: Floats
    """(2, 2) [m^2]"""
    guess: Floats | None
    """(2,), map frame [m]: where a new object starts; None for objects in the graph."""


@dataclass
class Problem:
    """Factors and starting values that wait for the solver."""

    factors: gtsam.NonlinearFactorGraph = field(default_factory=gtsam.NonlinearFactorGraph)
    values: gtsam.Values = field(default_factory=gtsam.Values)


def add_pose_prior(
    problem: Problem, pose: int, map_from_base: Pose2, sigmas: tuple[float, float, float]
) -> None:
    """Anchor a pose; `sigmas` of x, y [m] and yaw [rad]."""
    value = gtsam.Pose2(map_from_base.x, map_from_base.y, map_from_base.yaw)
    noise = gtsam.noiseModel.Diagonal.Sigmas(np.array(sigmas))
    problem.factors.add(gtsam.PriorFactorPose2(_x(pose), value, noise))
    problem.values.insert(_x(pose), value)


def add_object_prior(problem: Problem, number: int, mean: Floats, covariance: Floats) -> None:
    """Anchor an object (2,), (2, 2) in the map frame."""
    noise = gtsam.noiseModel.Gaussian.Covariance(covariance)
    problem.factors.add(gtsam.PriorFactorPoint2(_l(number), mean, noise))
    problem.values.insert(_l(number), mean)


def add_motion(problem: Problem, motion: Motion) -> None:
    """Add a pose and the odometry edge to it."""
    step, start = motion.before_from_after, motion.map_from_after
    noise = gtsam.noiseModel.Diagonal.Sigmas(np.sqrt(np.array(motion.variances)))
    edge = gtsam.Pose2(step.x, step.y, step.yaw)
    problem.factors.add(gtsam.BetweenFactorPose2(_x(motion.before), _x(motion.after), edge, noise))
    problem.values.insert(_x(motion.after), gtsam.Pose2(start.x, start.y, start.yaw))


def add_match(problem: Problem, before: int, after: int, match: Match) -> None:
    """Add an edge between two poses whose scans fit one another.

    It is robust: places may look alike.
    """
    step = match.before_from_after
    noise = _robust(gtsam.noiseModel.Gaussian.Covariance(match.covariance))
    edge = gtsam.Pose2(step.x, step.y, step.yaw)
    problem.factors.add(gtsam.BetweenFactorPose2(_x(before), _x(after), edge, noise))


def add_sighting(problem: Problem, sighting: Sighting) -> None:
    """Add a bearing-range edge that carries the whole planar covariance of the sighting.

    It is robust: one wrong association must not bend the map.
    """
    x, y = sighting.point.tolist()
    distance = math.hypot(x, y)
    jacobian = np.array([[-y, x], [x * distance, y * distance]]) / distance**2
    plain = gtsam.noiseModel.Gaussian.Covariance(jacobian @ sighting.covariance @ jacobian.T)
    noise = _robust(plain)
    problem.factors.add(
        gtsam.BearingRangeFactor2D(
            _x(sighting.pose), _l(sighting.object), gtsam.Rot2(math.atan2(y, x)), distance, noise
        )
    )
    if sighting.guess is not None:
        problem.values.insert(_l(sighting.object), sighting.guess)


def _robust(noise: gtsam.noiseModel.Base) -> gtsam.noiseModel.Robust:
    return gtsam.noiseModel.Robust.Create(gtsam.noiseModel.mEstimator.Huber.Create(1.345), noise)


def pose_key(pose: int) -> int:
    """Key of a pose in the solver."""
    return _x(pose)


def object_key(number: int) -> int:
    """Key of an object in the solver."""
    return _l(number)
