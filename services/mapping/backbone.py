"""Trajectory and seen objects, shared by all particles: one incremental QR solver (iSAM)."""

import math
from dataclasses import dataclass, replace

import gtsam
import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2, wrap_angle
from services.mapping import graph
from services.mapping.odometer import Odometer, OdometryNoise
from services.mapping.sightings import Sightings

pose_spacing = 1.0
"""A pose node at least every metre (Section "The Proposal Distribution") [m]."""
pose_turn = 0.6
"""And after such a turn, so that yaw drift is corrected too [rad]."""
_flush_after = 10
_still = 0.1
_anchor_sigmas = (0.01, 0.01, 0.003)
_failures = (RuntimeError, IndexError, ValueError)


@dataclass(frozen=True)
class Uncertainty:
    """Of the last pose node in the map."""

    position_variance: float
    """Mean over both axes [m^2]."""
    yaw_variance: float
    """[rad^2]"""


class Backbone:
    """The part of the map that the sensors alone decide.

    All particles condition on the same sensor data, hence on the same Gaussian over these nodes;
    what they differ in are leaves that language adds, which send no information back.

    Args:
        map_from_base: where the first pose node is.
        odom_from_base: dead reckoning there.
        earlier: x, y, yaw of pose nodes of an earlier life of the process (X, 3), shown only.
    """

    def __init__(self, map_from_base: Pose2, odom_from_base: Pose2, earlier: Floats) -> None:
        self.rejected = 0
        self.objects: dict[int, tuple[Floats, Floats]] = {}
        self.uncertainty = Uncertainty(0.0, 0.0)
        self._earlier = earlier
        self._poses = [map_from_base]
        self._odom_from_node = odom_from_base
        self._odometer = Odometer(odom_from_base)
        self._sightings = Sightings()
        self._isam = gtsam.ISAM2(_parameters())
        problem = graph.Problem()
        graph.add_pose_prior(problem, 0, map_from_base, _anchor_sigmas)
        self._solve(problem)

    @property
    def map_from_odom(self) -> Pose2:
        """Correction of the drift, as of the last pose node."""
        return self._poses[-1] @ self._odom_from_node.inverse()

    @property
    def trajectory(self) -> Floats:
        """Pose nodes x, y, yaw (X, 3) in the map frame."""
        mine = np.array([[pose.x, pose.y, pose.yaw] for pose in self._poses])
        return np.concatenate([self._earlier, mine])

    def locate(self, odom_from_base: Pose2) -> Pose2:
        """map_from_base at a moment of known dead reckoning."""
        return self.map_from_odom @ odom_from_base

    def move(self, odom_from_base: Pose2, noise: OdometryNoise) -> None:
        """Keep account of how far the wheels went since the last pose node."""
        self._odometer.move(odom_from_base, noise)

    def due(self, odom_from_base: Pose2) -> bool:
        """Whether the robot has gone or turned far enough for a new pose node."""
        step = self._odom_from_node.inverse() @ odom_from_base
        way, turn = math.hypot(step.x, step.y), abs(step.yaw)
        # Standing still adds nothing but nodes, however much is seen meanwhile.
        waiting = self._sightings.most >= _flush_after and (way > _still or turn > _still)
        return way >= pose_spacing or turn >= pose_turn or waiting

    def restore(self, number: int, mean: Floats, covariance: Floats) -> None:
        """Take up an object of an earlier life of the process: (2,), (2, 2), map frame."""
        problem = graph.Problem()
        graph.add_object_prior(problem, number, mean, covariance)
        if self._solve(problem):
            self.objects[number] = (mean, covariance)

    def sight(
        self, number: int, point_base: Floats, covariance: Floats, odom_from_base: Pose2
    ) -> None:
        """Note where an object was seen (2,), (2, 2), base frame, for the next `extend`."""
        node_from_base = self._odom_from_node.inverse() @ odom_from_base
        self._sightings.add(number, node_from_base, point_base, covariance)

    def extend(self, odom_from_base: Pose2) -> bool:
        """Solve with a new pose node here and all sightings noted since the last one.

        Returns False, and leaves the map as it was, when the solver refuses the new factors.
        """
        node = len(self._poses)
        problem, seen = graph.Problem(), list(self.objects)
        for sighting in self._sightings.take(node - 1):
            known = sighting.object in self.objects
            guess = None if known else self._poses[-1].apply(sighting.point)
            graph.add_sighting(problem, replace(sighting, guess=guess))
            seen.append(sighting.object)
        graph.add_motion(problem, self._motion(node, odom_from_base))
        if not self._solve(problem):
            return False
        self._poses.append(self.locate(odom_from_base))
        self._odom_from_node = odom_from_base
        self._odometer.restart(odom_from_base)
        self._read_out(seen)
        return True

    def _motion(self, node: int, odom_from_base: Pose2) -> graph.Motion:
        return graph.Motion(
            before=node - 1,
            after=node,
            before_from_after=self._odom_from_node.inverse() @ odom_from_base,
            variances=self._odometer.variances(odom_from_base),
            map_from_after=self.locate(odom_from_base),
        )

    def _solve(self, problem: graph.Problem) -> bool:
        # After an exception the solver answers on, but is corrupt: only a copy takes the risk.
        candidate = gtsam.ISAM2(self._isam)
        try:
            candidate.update(problem.factors, problem.values)
        except _failures:
            self.rejected += 1
            return False
        self._isam = candidate
        return True

    def _read_out(self, seen: list[int]) -> None:
        estimate = self._isam.calculateEstimate()
        for node in range(len(self._poses)):
            pose = estimate.atPose2(graph.pose_key(node))
            self._poses[node] = Pose2(pose.x(), pose.y(), wrap_angle(pose.theta()))
        for number in seen:
            key = graph.object_key(number)
            covariance: Floats = self._isam.marginalCovariance(key)
            self.objects[number] = (np.array(estimate.atPoint2(key)), covariance)
        own: Floats = self._isam.marginalCovariance(graph.pose_key(len(self._poses) - 1))
        self.uncertainty = Uncertainty((own[0, 0] + own[1, 1]) / 2, own[2, 2])


def _parameters() -> gtsam.ISAM2Params:
    parameters = gtsam.ISAM2Params()
    parameters.setFactorization("QR")
    parameters.relinearizeSkip = 1
    parameters.findUnusedFactorSlots = True
    return parameters
