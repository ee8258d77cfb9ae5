"""What one picture says, in the map's vocabulary and with honest covariances."""

from dataclasses import dataclass

import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2
from schemas.perception import Detections
from services.mapping.backbone import Uncertainty
from services.mapping.soundness import flaw_of_detection

_position_floor = 0.1
"""Calibration and attitude errors that the detector does not know of [m]."""
_range_share = 0.03
_extent_share = 0.15
"""A wide thing is seen from one side only; its centre is a guess."""


@dataclass(frozen=True)
class Picture:
    """Valid detections of one frame."""

    map_from_base: Pose2
    points_base: Floats
    """(N, 2) [m]"""
    points: Floats
    """(N, 2), map frame [m]."""
    covariances_base: Floats
    """(N, 2, 2) [m^2]"""
    covariances: Floats
    """(N, 2, 2), map axes [m^2]."""
    class_probability: Floats
    """(N, C) over the map's vocabulary; the rest to one is `none`."""
    extents: Floats
    """(N, 3) [m]"""
    uncertainty: Uncertainty
    """Of the pose from which the picture was taken."""
    flaws: tuple[str, ...] = ()
    """Why each of the other detections was left out."""


def read_picture(
    detections: Detections,
    vocabulary: tuple[str, ...],
    map_from_base: Pose2,
    uncertainty: Uncertainty,
) -> Picture:
    """What is sound of a picture, at the pose that is given."""
    flaws = [flaw_of_detection(detections, row) for row in range(len(detections.scores))]
    keep = [row for row, flaw in enumerate(flaws) if not flaw]
    points = detections.centers_base[keep, :2]
    widened = _widened(detections, keep)
    rotation = map_from_base.lifted().rotation()[:2, :2]
    return Picture(
        map_from_base=map_from_base,
        points_base=points,
        points=map_from_base.apply(points),
        covariances_base=widened,
        covariances=rotation @ widened @ rotation.T,
        class_probability=_in_vocabulary(detections, vocabulary, keep),
        extents=detections.extents[keep],
        uncertainty=uncertainty,
        flaws=tuple(flaw for flaw in flaws if flaw),
    )


def _widened(detections: Detections, keep: list[int]) -> Floats:
    distance = np.linalg.norm(detections.centers_base[keep, :2], axis=1)
    width = detections.extents[keep, :2].max(axis=1, initial=0.0)
    extra = _position_floor**2 + (_range_share * distance) ** 2 + (_extent_share * width) ** 2
    return detections.covariances[keep, :2, :2] + extra[:, None, None] * np.eye(2)


def _in_vocabulary(detections: Detections, vocabulary: tuple[str, ...], keep: list[int]) -> Floats:
    table = np.zeros((len(keep), len(vocabulary)))
    for column, name in enumerate(detections.classes):
        target = vocabulary.index(name if name in vocabulary else "unknown")
        table[:, target] += detections.probabilities[keep, column]
    return table
