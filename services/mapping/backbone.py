"""Trajectory and seen objects, shared by all particles: one incremental QR solver (iSAM)."""

import math
from dataclasses import dataclass, replace

import gtsam
import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2
from services.mapping import graph
from services.mapping.marginals import marginals_of
from services.mapping.odometer import Odometer, OdometryNoise
from services.mapping.scan_memory import ScanMemory
from services.mapping.sightings import Sightings

pose_spacing = 1.0
"""A pose node at least every metre (Section "The Proposal Distribution") [m]."""
pose_turn = 0.6
"""And after such a turn, so that yaw drift is corrected too [rad]."""
_flush_after = 10
_still = 0.1
_anchor_sigmas = (0.01, 0.01, 0.003)
_failures = (RuntimeError, IndexError, ValueError)
"""What the solver raises when factors and values do not make a map."""
_jump_variances = (1.0, 1.0, 0.25)
"""Of x, y [m^2] and yaw [rad^2] where dead reckoning broke off and began again."""


@dataclass(frozen=True)
class Uncertainty:
    """Of the last pose node in the map."""

    position_variance: float
    """Mean over both axes [m^2]."""
    yaw_variance: float
    """[rad^2]"""


@dataclass(frozen=True)
class _Solution:
    """A solver that has taken new factors, and what it says."""

    isam: gtsam.ISAM2
    poses: Floats
    """(X, 3) x, y, yaw."""
    objects: dict[int, tuple[Floats, Floats]]
    pose_covariance: Floats
    """(3, 3) of the last pose."""

    @property
    def is_finite(self) -> bool:
        """Whether it is an answer at all."""
        parts = [self.poses, self.pose_covariance]
        parts += [part for thing in self.objects.values() for part in thing]
        return all(bool(np.isfinite(part).all()) for part in parts)


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
        self.refusal = ""
        """Why the solver refused factors the last time."""
        self.objects: dict[int, tuple[Floats, Floats]] = {}
        self.uncertainty = Uncertainty(0.0, 0.0)
        self._earlier = earlier
        self._poses: Floats = np.array([[map_from_base.x, map_from_base.y, map_from_base.yaw]])
        self._odom_from_node = odom_from_base
        self._odometer = Odometer(odom_from_base)
        self._sightings = Sightings()
        self._scans = ScanMemory()
        self._isam = gtsam.ISAM2(_parameters())
        problem = graph.Problem()
        graph.add_pose_prior(problem, 0, map_from_base, _anchor_sigmas)
        self._solve(problem, 1, [])

    @property
    def map_from_odom(self) -> Pose2:
        """Correction of the drift, as of the last pose node."""
        return self._last_node @ self._odom_from_node.inverse()

    @property
    def trajectory(self) -> Floats:
        """Pose nodes x, y, yaw (X, 3) in the map frame."""
        return np.concatenate([self._earlier, self._poses])

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

    def restore(self, number: int, mean: Floats, covariance: Floats) -> bool:
        """Take up an object of an earlier life of the process: (2,), (2, 2), map frame."""
        problem = graph.Problem()
        graph.add_object_prior(problem, number, mean, covariance)
        return self._solve(problem, len(self._poses), [number])

    def sight(
        self, number: int, point_base: Floats, covariance: Floats, odom_from_base: Pose2
    ) -> None:
        """Note where an object was seen (2,), (2, 2), base frame, for the next `extend`."""
        node_from_base = self._odom_from_node.inverse() @ odom_from_base
        self._sightings.add(number, node_from_base, point_base, covariance)

    def scan(self, points: Floats, odom_from_base: Pose2) -> None:
        """Note what the range finder saw (n, 2), base frame, in the order of its beams."""
        self._scans.latest = odom_from_base.apply(points)

    def extend(self, odom_from_base: Pose2) -> bool:
        """Solve with a new pose node here and all sightings noted since the last one.

        Returns False, and leaves the map as it was, when the solver refuses the new factors.
        """
        step = self._odom_from_node.inverse() @ odom_from_base
        return self._add_node(odom_from_base, step, self._odometer.variances(odom_from_base))

    def jump(self, before: Pose2, after: Pose2) -> bool:
        """Begin dead reckoning anew: it says `after` where it had said `before` (odom_from_base).

        The robot is believed to be about where it was: an edge that says little goes between the
        two beginnings, so that nothing that was mapped is bent, and what is seen again decides.
        """
        self.extend(before)
        self._scans.latest = None
        return self._add_node(after, Pose2(0.0, 0.0, 0.0), _jump_variances)

    @property
    def _last_node(self) -> Pose2:
        return Pose2(*self._poses[-1].tolist())

    def _add_node(
        self, odom_from_base: Pose2, step: Pose2, variances: tuple[float, float, float]
    ) -> bool:
        node, here = len(self._poses), self._last_node
        problem, seen = graph.Problem(), list[int]()
        for sighting in self._sightings.take(node - 1):
            known = sighting.object in self.objects
            guess = None if known else here.apply(sighting.point)
            graph.add_sighting(problem, replace(sighting, guess=guess))
            seen.append(sighting.object)
        graph.add_motion(problem, graph.Motion(node - 1, node, step, variances, here @ step))
        points = self._scans.seen_from(odom_from_base)
        if edge := self._scans.edge(points, here @ step, self._poses):
            graph.add_match(problem, edge.reference, node, edge.match)
        if not self._solve(problem, node + 1, seen):
            return False
        self._scans.keep(node, points)
        self._odom_from_node = odom_from_base
        self._odometer.restart(odom_from_base)
        return True

    def _solve(self, problem: graph.Problem, poses: int, seen: list[int]) -> bool:
        # After an exception the solver answers on, but is corrupt: only a copy takes the risk.
        candidate = gtsam.ISAM2(self._isam)
        try:
            candidate.update(problem.factors, problem.values)
            solution = self._read_out(candidate, poses, seen)
        except _failures as error:
            return self._refuse(str(error).strip().partition("\n")[0])
        if not solution.is_finite:
            return self._refuse("the solution is not finite")
        self._isam, self._poses, self.objects = solution.isam, solution.poses, solution.objects
        own = solution.pose_covariance
        self.uncertainty = Uncertainty((own[0, 0] + own[1, 1]) / 2, own[2, 2])
        return True

    def _refuse(self, reason: str) -> bool:
        self.rejected, self.refusal = self.rejected + 1, reason
        return False

    def _read_out(self, isam: gtsam.ISAM2, poses: int, seen: list[int]) -> _Solution:
        estimate = isam.calculateEstimate()
        found: Floats = gtsam.utilities.extractPose2(estimate)
        assert len(found) == poses
        found[:, 2] = (found[:, 2] + math.pi) % (2 * math.pi) - math.pi
        numbers = list(dict.fromkeys([*self.objects, *seen]))
        marginals = marginals_of(isam, len(numbers), poses)
        means: Floats = gtsam.utilities.extractPoint2(estimate)
        rows = {number: row for row, number in enumerate(sorted(numbers))}
        objects = {
            number: (means[rows[number]], marginals.objects[rows[number]]) for number in numbers
        }
        return _Solution(isam, found, objects, marginals.last_pose)


def _parameters() -> gtsam.ISAM2Params:
    parameters = gtsam.ISAM2Params()
    parameters.setFactorization("QR")
    parameters.relinearizeSkip = 1
    parameters.findUnusedFactorSlots = True
    return parameters
