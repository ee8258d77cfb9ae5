"""Where one scan was taken, seen from another: iterated closest points, to lines (Censi, 2008).

Walls are lines, so a point is drawn to the line through its neighbours and may slide along it. What
no wall fixes, as the way along a corridor, stays uncertain in the covariance. Where there is little
to match, as on open ground, nothing is said at all.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from schemas.arrays import Floats
from schemas.geometry import Pose2

_least_points = 40
"""Scans with fewer points on lines do not fix a pose."""
_widest_gap = 0.5
"""Neighbouring beams that end farther apart are on different things [m]."""
_reaches = (0.6, 0.6, 0.4, 0.4, 0.25, 0.25, 0.25, 0.25)
"""Points farther apart are no pair; one value an iteration [m]."""
_least_share = 0.6
"""Of the points that find a partner."""
_worst_residual = 0.06
"""Mean distance of points from their lines [m]."""
_farthest, _widest_turn = 0.6, 0.2
"""A match farther from the guess is another place that looks alike [m], [rad]."""
_deviation = 0.03
"""Of one point from its line: the sensor's, and that of drawing lines between beams [m]."""
_correlation = 4.0
"""Neighbouring points err alike: so many of them count as one."""
_spacing = 0.1
"""Of the points that are used [m]."""
_neighbours = 2
"""To each side: a line is drawn through these."""
_unknown = np.diag([1.0, 1.0, 0.1])
"""Covariance of what the lines do not fix [m^2, rad^2]."""
_prior = np.linalg.inv(_unknown)


@dataclass(frozen=True)
class Match:
    """An edge between two poses."""

    before_from_after: Pose2
    covariance: Floats
    """(3, 3) Of x, y [m^2] and yaw [rad^2] in the frame of the pose after."""


def match(reference: Floats, scan: Floats, guess: Pose2) -> Match | None:
    """Where `scan` (n, 2) was taken in the frame of `reference` (m, 2), None if it does not say.

    Args:
        reference: points in the order of the beams, own frame [m].
        scan: likewise.
        guess: reference_from_scan.
    """
    lines, normals = _on_lines(reference)
    points, _ = _on_lines(scan)
    if min(len(lines), len(points)) < _least_points:
        return None
    tree, pose = KDTree(lines), guess
    for reach in _reaches:
        fit = _fit(tree, normals, points, pose, reach)
        if fit.share < _least_share:
            return None
        pose = fit.improved(guess)
    fit = _fit(tree, normals, points, pose, _reaches[-1])
    step = guess.inverse() @ pose
    far = np.hypot(step.x, step.y) > _farthest or abs(step.yaw) > _widest_turn
    if far or fit.share < _least_share or fit.residual > _worst_residual:
        return None
    return Match(pose, _turned(fit.information, pose.yaw))


@dataclass(frozen=True)
class _Fit:
    """Points paired with lines at one pose."""

    pose: Pose2
    information: Floats
    """(3, 3) About a step of the pose in the axes of the reference, turning about the scan."""
    gradient: Floats
    """(3,)"""
    share: float
    residual: float

    def improved(self, guess: Pose2) -> Pose2:
        """The pose after a step; what no line fixes stays as it was guessed."""
        pose = self.pose
        drift = np.array([guess.x - pose.x, guess.y - pose.y, (guess.inverse() @ pose).yaw * -1])
        step = np.linalg.solve(self.information + _prior, self.gradient + _prior @ drift)
        dx, dy, turn = step.tolist()
        return Pose2(pose.x + dx, pose.y + dy, 0.0) @ Pose2(0.0, 0.0, pose.yaw + turn)


def _fit(tree: KDTree, normals: Floats, points: Floats, pose: Pose2, reach: float) -> _Fit:
    here = pose.apply(points)
    found = tree.query(here, distance_upper_bound=reach)
    distance, row = np.asarray(found[0]), np.asarray(found[1])
    paired = np.isfinite(distance)
    normal = normals[row[paired]]
    offset = here[paired] - np.asarray(tree.data)[row[paired]]
    away = np.sum(normal * offset, axis=1)
    arm = here[paired] - (pose.x, pose.y)
    turning = normal[:, 1] * arm[:, 0] - normal[:, 0] * arm[:, 1]
    jacobian = np.column_stack([normal, turning])
    weight = 1 / (_deviation**2 * _correlation * np.maximum(1.0, np.abs(away) / _deviation))
    return _Fit(
        pose=pose,
        information=(jacobian * weight[:, None]).T @ jacobian,
        gradient=-(jacobian * weight[:, None]).T @ away,
        share=float(np.mean(paired)),
        residual=float(np.mean(np.abs(away))) if paired.any() else np.inf,
    )


def _on_lines(points: Floats) -> tuple[Floats, Floats]:
    """Points (k, 2) that have neighbours on both sides, and unit normals (k, 2) there."""
    points = _thinned(points)
    if len(points) <= 2 * _neighbours:
        return points[:0], points[:0]
    along = np.roll(points, -_neighbours, axis=0) - np.roll(points, _neighbours, axis=0)
    length = np.hypot(*along.T)
    joined = np.hypot(*(np.roll(points, -1, axis=0) - points).T) < _widest_gap
    kept = length > _spacing
    for step in range(-_neighbours, _neighbours):
        kept &= np.roll(joined, -step)
    unit = along[kept] / length[kept, None]
    return points[kept], np.stack([-unit[:, 1], unit[:, 0]], axis=1)


def _thinned(points: Floats) -> Floats:
    """Points of a scan (n, 2) at even distances: close to a wall, noise would turn its normals."""
    if not len(points):
        return points
    way = np.cumsum(np.hypot(*np.diff(points, axis=0, prepend=points[:1]).T))
    _, first = np.unique(np.floor(way / _spacing), return_index=True)
    return points[first]


def _turned(information: Floats, yaw: float) -> Floats:
    """The covariance in the axes of the scan, which are turned by `yaw`."""
    c, s = np.cos(yaw), np.sin(yaw)
    scan_from_reference = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    covariance = np.linalg.inv(information + _prior)
    turned = scan_from_reference @ covariance @ scan_from_reference.T
    return np.asarray(turned, np.float64)
