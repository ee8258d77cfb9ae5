"""Spatial relations: where a figure stands given its landmark and the place of the speaker.

The frame has its origin at the landmark, u from the viewer to the landmark, v to the left of u:
"behind" is +u, "left" is +v. For the robot itself as landmark its own heading counts. In it the
figure is a Gaussian whose mean is linear in features of both things and of the robot's location
at the time of the utterance (Section "Modifying the graph based on natural language"); what
holds in every direction, as "near", is a Gaussian over the distance instead. The variance is a
sum of independent parts, each growing with the square of a feature, so that it is linear too.

The covariance is split, Q = Q_s + Q_r: an offset sampled from Q_s sets the particles apart, so
that looking can tell them apart, and Q_r stays analytic in every particle.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import ndtri

from schemas.arrays import Floats
from schemas.geometry import Pose2

features = ("one", "figure_radius", "depth", "width", "distance", "of_robot")
"""Columns D of phi: 1; radius of the figure; half the landmark's box along u and along v; from
the viewer to the landmark, all [m]; 1 where the robot is the landmark."""
residual = 0.5
"""Square root of Q_r [m]."""
_least_sampled = 0.1**2
"""Of Q_s [m^2]: of a relation more precise than Q_r too, particles are set apart."""


@dataclass(frozen=True)
class Frame:
    """Frames of a relation at n landmarks."""

    u: Floats
    """(n, 2) unit vectors, map frame."""
    v: Floats
    """(n, 2)"""
    distance: Floats
    """(n,) from the viewer to the landmark [m]."""
    of_robot: bool
    """Whether the robot itself is the landmark."""


def frame_at(landmark: Floats, viewer: Pose2) -> Frame:
    """Frame of a viewer at landmarks (n, 2), map frame."""
    ray = landmark - np.array([viewer.x, viewer.y])
    length = np.linalg.norm(ray, axis=1, keepdims=True)
    heading = np.array([np.cos(viewer.yaw), np.sin(viewer.yaw)])
    u = np.where(length > 1e-6, ray / np.maximum(length, 1e-6), heading)
    return Frame(u, np.stack([-u[:, 1], u[:, 0]], axis=1), length[:, 0], of_robot=False)


def frame_of_robot(viewer: Pose2, count: int) -> Frame:
    """Frame of the robot as landmark: behind is behind its back, left is its left."""
    c, s = np.cos(viewer.yaw), np.sin(viewer.yaw)
    u, v = np.tile([-c, -s], (count, 1)), np.tile([-s, c], (count, 1))
    return Frame(u, v, np.zeros(count), of_robot=True)


def features_of(frame: Frame, figure_radius: Floats, landmark_half: Floats) -> Floats:
    """Columns phi (n, D).

    Args:
        frame: of n pairs.
        figure_radius: (n,) [m].
        landmark_half: (n, 2) half the landmark's bounding box, map axes [m].
    """
    # Half the ellipse in the box: of a round thing the radius, whatever the direction.
    depth = np.hypot(*(frame.u * landmark_half).T)
    width = np.hypot(*(frame.v * landmark_half).T)
    one, robot = np.ones_like(depth), np.full_like(depth, float(frame.of_robot))
    return np.stack([one, figure_radius, depth, width, frame.distance, robot], axis=1)


@dataclass(frozen=True)
class Axis:
    """Gaussian over one coordinate."""

    mean: Floats
    """(D,) weights of phi [m per unit]."""
    variance: Floats
    """(D,) weights of phi squared, none below 0, of Q."""

    def moments(self, phi: Floats) -> tuple[Floats, Floats]:
        """Means (n,) and variances (n,) of what is sampled, Q_s [m], [m^2]."""
        sampled = phi**2 @ self.variance - residual**2
        return phi @ self.mean, np.maximum(sampled, _least_sampled)


class Shape(Protocol):
    """Conditional density of the offset from landmark to figure, n pairs at a time."""

    def sample(self, points: Floats, frame: Frame, phi: Floats) -> Floats:
        """Offsets (n, 2) of Q_s, map axes, made of points (n, 2) of the unit square."""
        ...

    def log_density(
        self, frame: Frame, offset: Floats, phi: Floats, variance: Floats | float
    ) -> Floats:
        """Of offsets (n, 2) under Q_s widened by an isotropic `variance` (n,) [m^2]."""
        ...


@dataclass(frozen=True)
class Directed:
    """The figure lies to one side, or in the landmark."""

    along: Axis
    """u"""
    across: Axis
    """v"""

    def sample(self, points: Floats, frame: Frame, phi: Floats) -> Floats:
        """See `Shape`."""
        (u, spread_u), (v, spread_v) = self.along.moments(phi), self.across.moments(phi)
        a, b = ndtri(points).T
        u, v = u + np.sqrt(spread_u) * a, v + np.sqrt(spread_v) * b
        return u[:, None] * frame.u + v[:, None] * frame.v

    def log_density(
        self, frame: Frame, offset: Floats, phi: Floats, variance: Floats | float
    ) -> Floats:
        """See `Shape`."""
        (u, spread_u), (v, spread_v) = self.along.moments(phi), self.across.moments(phi)
        off_u = np.sum(offset * frame.u, axis=1) - u
        off_v = np.sum(offset * frame.v, axis=1) - v
        return _log_normal(off_u, spread_u + variance) + _log_normal(off_v, spread_v + variance)


@dataclass(frozen=True)
class Radial:
    """The figure lies at a distance, in any direction."""

    distance: Axis

    def sample(self, points: Floats, frame: Frame, phi: Floats) -> Floats:
        """See `Shape`."""
        del frame
        mean, spread = self.distance.moments(phi)
        angle = 2 * np.pi * points[:, 0]
        distance = np.abs(mean + np.sqrt(spread) * ndtri(points[:, 1]))
        return distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def log_density(
        self, frame: Frame, offset: Floats, phi: Floats, variance: Floats | float
    ) -> Floats:
        """See `Shape`."""
        del frame
        mean, spread = self.distance.moments(phi)
        distance, spread = np.linalg.norm(offset, axis=1), spread + variance
        # `sample` folds negative distances back, so the density has a second, mirrored branch.
        folded = np.logaddexp(
            _log_normal(distance - mean, spread), _log_normal(distance + mean, spread)
        )
        return folded - np.log(2 * np.pi * np.maximum(distance, 0.1))


@dataclass(frozen=True, eq=False)
class Relation:
    """A shape, and the share of cases in which a person meant something else by the word.

    Compared by identity: there is one of each in the table, and weights are arrays.
    """

    shape: Shape
    outlier_share: float
    outlier_spread: float
    """Standard deviation of the offset in these cases, in each direction [m]."""

    def sample(self, points: Floats, frame: Frame, phi: Floats) -> Floats:
        """Offsets (n, 2) from landmark to figure made of points (n, 3) of the unit cube."""
        anywhere = self.outlier_spread * ndtri(points[:, :2])
        is_outlier = points[:, 2:] < self.outlier_share
        return np.where(is_outlier, anywhere, self.shape.sample(points[:, :2], frame, phi))

    def log_density(
        self, frame: Frame, offset: Floats, phi: Floats, variance: Floats | float
    ) -> Floats:
        """Log density (n,) of what `sample` makes of even points, widened by `variance` (n,)."""
        near = self.shape.log_density(frame, offset, phi, variance)
        wide = np.broadcast_to(self.outlier_spread**2 + variance, len(offset))
        anywhere = np.sum(_log_normal(offset, wide[:, None]), axis=1)
        share = self.outlier_share
        return np.logaddexp(np.log1p(-share) + near, np.log(share) + anywhere)


def _log_normal(value: Floats, variance: Floats | float) -> Floats:
    return -0.5 * (value**2 / variance + np.log(2 * np.pi * variance))
