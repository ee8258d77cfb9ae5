"""Spatial relations: where a figure stands given its landmark and the place of the speaker.

The frame has its origin at the landmark, u from the viewer to the landmark, v to the left of u:
"behind" is +u, "left" is +v. For the robot itself as landmark its own heading counts.
The paper learns a Gaussian whose mean is linear in features of the regions and the robot's
location; these are its defaults without data: the mean is linear in the radii of both things.

The covariance is split, Q = Q_s + Q_r: an offset sampled from Q_s sets the particles apart, so
that looking can tell them apart, and Q_r stays analytic in every particle.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2

residual = 0.5
"""Square root of Q_r [m]."""
_outlier_share = 0.01
_outlier_spread = 5.0


@dataclass(frozen=True)
class Frame:
    """Unit vectors (n, 2) of the relation's frame at each landmark."""

    u: Floats
    v: Floats


def frame_at(landmark: Floats, viewer: Pose2) -> Frame:
    """Frame of a viewer at landmarks (n, 2), map frame."""
    ray = landmark - np.array([viewer.x, viewer.y])
    length = np.linalg.norm(ray, axis=1, keepdims=True)
    heading = np.array([np.cos(viewer.yaw), np.sin(viewer.yaw)])
    u = np.where(length > 1e-6, ray / np.maximum(length, 1e-6), heading)
    return Frame(u, np.stack([-u[:, 1], u[:, 0]], axis=1))


def frame_of_robot(viewer: Pose2, count: int) -> Frame:
    """Frame of the robot as landmark: behind is behind its back, left is its left."""
    c, s = np.cos(viewer.yaw), np.sin(viewer.yaw)
    return Frame(np.tile([-c, -s], (count, 1)), np.tile([-s, c], (count, 1)))


class Relation(Protocol):
    """Conditional density of the figure given the landmark, n pairs at a time."""

    def sample(self, rng: np.random.Generator, frame: Frame, radii: Floats) -> Floats:
        """Offsets (n, 2) from landmark to figure drawn from Q_s; `radii` (n,) of both things."""
        ...

    def log_density(self, frame: Frame, offset: Floats, radii: Floats, variance: Floats) -> Floats:
        """Of offsets (n, 2) under Q_s widened by an isotropic `variance` (n,) [m^2]."""
        ...


@dataclass(frozen=True)
class Directed:
    """The figure lies to one side."""

    u: float
    v: float
    gap: float
    """Free way between the two things [m]."""
    along: float
    """Square root of Q_s in the direction of the relation [m]."""
    across: float
    """And at right angles to it [m]."""

    def sample(self, rng: np.random.Generator, frame: Frame, radii: Floats) -> Floats:
        """See `Relation`."""
        forward, left = self._axes(frame)
        a, b = rng.standard_normal((2, len(radii)))
        mean = (radii + self.gap) * self._directed
        return (mean + self.along * a)[:, None] * forward + (self.across * b)[:, None] * left

    def log_density(self, frame: Frame, offset: Floats, radii: Floats, variance: Floats) -> Floats:
        """See `Relation`."""
        forward, left = self._axes(frame)
        a = np.sum(offset * forward, axis=1) - (radii + self.gap) * self._directed
        b = np.sum(offset * left, axis=1)
        return _log_normal(a, self.along**2 + variance) + _log_normal(b, self.across**2 + variance)

    @property
    def _directed(self) -> float:
        return 1.0 if self.u or self.v else 0.0

    def _axes(self, frame: Frame) -> tuple[Floats, Floats]:
        if not self._directed:
            return frame.u, frame.v
        forward = self.u * frame.u + self.v * frame.v
        return forward, np.stack([-forward[:, 1], forward[:, 0]], axis=1)


@dataclass(frozen=True)
class Radial:
    """The figure lies at a distance, in any direction."""

    gap: float
    spread: float

    def sample(self, rng: np.random.Generator, frame: Frame, radii: Floats) -> Floats:
        """See `Relation`."""
        del frame
        angle = rng.uniform(-np.pi, np.pi, len(radii))
        distance = np.abs(radii + self.gap + self.spread * rng.standard_normal(len(radii)))
        return distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def log_density(self, frame: Frame, offset: Floats, radii: Floats, variance: Floats) -> Floats:
        """See `Relation`."""
        del frame
        distance = np.linalg.norm(offset, axis=1)
        mean, spread = radii + self.gap, self.spread**2 + variance
        # `sample` folds negative distances back, so the density has a second, mirrored branch.
        folded = np.logaddexp(
            _log_normal(distance - mean, spread), _log_normal(distance + mean, spread)
        )
        return folded - np.log(2 * np.pi * np.maximum(distance, 0.1))


_vague = Radial(gap=3.0, spread=2.5)
relations: dict[str, Relation] = {
    "back": Directed(u=1, v=0, gap=2.4, along=1.0, across=0.8),
    "front": Directed(u=-1, v=0, gap=2.0, along=1.0, across=0.8),
    "left": Directed(u=0, v=1, gap=2.0, along=1.0, across=0.8),
    "right": Directed(u=0, v=-1, gap=2.0, along=1.0, across=0.8),
    "past": Directed(u=1, v=0, gap=4.0, along=2.0, across=1.2),
    "down": Directed(u=1, v=0, gap=4.0, along=2.0, across=1.2),
    "inside": Directed(u=0, v=0, gap=0.0, along=0.3, across=0.3),
    "near": Radial(gap=1.5, spread=0.8),
    "away": Radial(gap=6.0, spread=2.5),
}
nearest: Relation = Radial(gap=2.0, spread=1.5)
"""The comparative leaves the distance open and compares the candidates instead."""


def relation_named(name: str, comparative: bool) -> Relation:
    """Density of a relation symbol; those without a shape of their own are vague nearness."""
    return nearest if comparative and name == "near" else relations.get(name, _vague)


def sample_figure(
    relation: Relation, rng: np.random.Generator, frame: Frame, radii: Floats
) -> Floats:
    """Offsets (n, 2) from the relation or, rarely, from anywhere around: people are imprecise."""
    offset = relation.sample(rng, frame, radii)
    anywhere = _outlier_spread * rng.standard_normal(offset.shape)
    return np.where(rng.random(len(offset))[:, None] < _outlier_share, anywhere, offset)


def log_likelihood(
    relation: Relation, frame: Frame, offset: Floats, radii: Floats, variance: Floats
) -> Floats:
    """Log density (n,) of what `sample_figure` draws, widened by `variance` (n,) [m^2]."""
    near = relation.log_density(frame, offset, radii, variance)
    wide = np.sum(_log_normal(offset, _outlier_spread**2), axis=1)
    return np.logaddexp(np.log1p(-_outlier_share) + near, np.log(_outlier_share) + wide)


def _log_normal(value: Floats, variance: Floats | float) -> Floats:
    return -0.5 * (value**2 / variance + np.log(2 * np.pi * variance))
