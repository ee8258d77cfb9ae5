"""What makes a sensor message no evidence at all, in words.

The codec has checked types and that columns are of one length. What remains are values that no
sensor means: not finite, negative where nothing is, or more names than columns.
"""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from schemas.arrays import Floats
from schemas.geometry import Pose2
from schemas.language import Annotations
from schemas.perception import Detections, Inspection, SceneObservation
from schemas.sensing import LaserScan, Odometry

_horizon = 500.0
"""No camera sees a thing farther off [m]."""
_asymmetry = 1e-6
"""Relative; rounding on the way through a detector is smaller."""
_sum_slack = 1e-6


def flaw_of(message: Struct) -> str:
    """Why the whole message cannot be used, "" if it can."""
    checks: dict[type[Struct], Callable[[Any], str]] = {
        Odometry: _flaw_of_odometry,
        LaserScan: _flaw_of_scan,
        Detections: _flaw_of_picture,
        SceneObservation: _flaw_of_scene,
        Inspection: _flaw_of_inspection,
        Annotations: _flaw_of_annotations,
    }
    check = checks.get(type(message))
    return check(message) if check else ""


def mended(message: Struct) -> tuple[Struct, str]:
    """A usable message without what in it is no evidence, and what that was, "" if nothing."""
    if isinstance(message, LaserScan):
        return message, _flaw_of_ranges(message)
    if isinstance(message, Detections) and (flaw := _flaw_of_view(message)):
        nowhere = np.zeros(0)
        return replace(message, view_bearings=nowhere, view_ranges=nowhere), flaw
    return message, ""


def flaw_of_detection(picture: Detections, row: int) -> str:
    """Why one detection cannot be used, "" if it can."""
    center, extent = picture.centers_base[row], picture.extents[row]
    if not (np.isfinite(center).all() and np.abs(center).max() < _horizon):
        return f"its centre {_numbers(center)} is no place within {_horizon:g} m"
    if not (np.isfinite(extent).all() and extent.min() >= 0 and extent.max() < _horizon):
        return f"its extent {_numbers(extent)} is no size"
    likely = picture.probabilities[row]
    if not (np.isfinite(likely).all() and likely.min(initial=0.0) >= 0):
        return f"its class probabilities {_numbers(likely)} are none"
    if likely.sum() > 1 + _sum_slack:
        return f"its class probabilities sum to {likely.sum():.3g}, allowed is at most 1"
    return _flaw_of_covariance(picture.covariances[row, :2, :2])


def _flaw_of_covariance(matrix: Floats) -> str:
    if not np.isfinite(matrix).all():
        return "its covariance is not finite"
    if np.abs(matrix - matrix.T).max() > _asymmetry * np.abs(matrix).max():
        return "its covariance is not symmetric"
    if np.linalg.eigvalsh(matrix)[0] <= 0:
        return "its covariance is not positive definite"
    return ""


def _flaw_of_inspection(message: Inspection) -> str:
    center = message.center_base
    if not (np.isfinite(center).all() and np.abs(center).max() < _horizon):
        return f"its centre {_numbers(center)} is no place within {_horizon:g} m"
    if not 0 <= message.seen <= 1:
        return f"the share that was seen, {message.seen:.3g}, is not in [0, 1]"
    return ""


def _flaw_of_odometry(message: Odometry) -> str:
    growth = (message.variance_per_metre, message.variance_per_radian)
    if not all(math.isfinite(value) and value >= 0 for value in growth):
        return f"its variances grow by {growth}, which is no noise"
    return _flaw_of_pose(message.odom_from_base)


def _flaw_of_scan(message: LaserScan) -> str:
    if not len(message.ranges):
        return "it has no beams"
    if not (math.isfinite(message.angle_min) and math.isfinite(message.angle_increment)):
        return "its angles are not finite"
    if message.angle_increment == 0:
        return "all its beams have one direction"
    if not (math.isfinite(message.range_max) and message.range_max > 0):
        return f"its largest range is {message.range_max}"
    if not _is_finite(message.base_from_laser):
        return "the pose of the laser is not finite"
    return _flaw_of_pose(message.odom_from_base)


def _flaw_of_ranges(message: LaserScan) -> str:
    # Such beams neither free nor fill a cell; infinite ones saw that nothing is there.
    broken = int(np.sum(np.isnan(message.ranges) | (message.ranges < 0)))
    return f"{broken} of {len(message.ranges)} ranges are no distance" if broken else ""


def _flaw_of_picture(message: Detections) -> str:
    if not message.classes:
        return "it was looked for no class, so nothing follows from it"
    columns = message.probabilities.shape[1]
    if columns != len(message.classes):
        return f"it names {len(message.classes)} classes and has probabilities of {columns}"
    return _flaw_of_pose(message.odom_from_base)


def _flaw_of_view(message: Detections) -> str:
    bearings = message.view_bearings
    if not (np.isfinite(bearings).all() and all(a <= b for a, b in pairwise(bearings.tolist()))):
        return "its view is not ascending in bearing, so what it does not show is no evidence"
    if not math.isfinite(message.view_near):
        return "the near end of its view is no number, so what it does not show is no evidence"
    return ""


def _flaw_of_scene(message: SceneObservation) -> str:
    columns = message.probabilities.shape[1]
    if columns != len(message.types):
        return f"it names {len(message.types)} types and has probabilities of {columns}"
    if not np.isfinite(message.points_base).all():
        return "a place that it speaks of is not finite"
    if not (np.isfinite(message.probabilities).all() and (message.probabilities >= 0).all()):
        return "its type probabilities are none"
    return _flaw_of_pose(message.odom_from_base)


def _flaw_of_annotations(message: Annotations) -> str:
    likely = [annotation.probability for annotation in message.annotations]
    if not all(0 <= value <= 1 + _sum_slack for value in likely):
        return f"its readings have probabilities {likely}"
    return ""


def _flaw_of_pose(pose: Pose2) -> str:
    return "" if _is_finite(pose) else "its dead reckoning is not finite"


def _is_finite(pose: Pose2) -> bool:
    return all(math.isfinite(value) for value in (pose.x, pose.y, pose.yaw))


def _numbers(values: Floats) -> str:
    return "(" + ", ".join(f"{value:.3g}" for value in values.tolist()) + ")"
