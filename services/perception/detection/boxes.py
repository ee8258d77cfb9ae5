"""Boxes in a picture, and how of several on one object one is left."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from schemas.arrays import Flags, Floats, Ints
from services.perception.detection.calibration import Calibration
from services.perception.detection.decoding import Predictions
from services.perception.detection.picture import Fit

class_overlap = 0.5
"""Of two boxes of one class that overlap by more than this (IoU) the lower score goes."""
any_overlap = 0.8
"""The same for boxes of different classes: one object, whose distribution already doubts."""
_least_side = 1.0
"""Of a box; what is left of one beside the picture is thinner [px]."""


@dataclass(frozen=True)
class Boxes:
    """What was found in one picture, best first."""

    corners_px: Floats
    """(N, 4) x0 y0 x1 y1, within the picture."""
    scores: Floats
    """(N,) confidence in [0, 1]; not a calibrated probability."""
    class_scores: Floats
    """(N, C) in [0, 1], each class by itself; rows do not sum to 1."""
    probabilities: Floats
    """(N, C) calibrated distribution over classes; what a row lacks to 1 is "none of these"."""

    @property
    def classes(self) -> Ints:
        """(N,) index of the best class of each box."""
        return self.class_scores.argmax(axis=1).astype(np.int32)

    def selected(self, index: Ints | Flags) -> "Boxes":
        """The rows named."""
        columns = (self.corners_px, self.scores, self.class_scores, self.probabilities)
        return Boxes(*(column[index] for column in columns))


def likely(predictions: Predictions, threshold: float, calibration: Calibration) -> Boxes:
    """Predictions that reach the threshold, best first; what is no number is left out."""
    kept = np.flatnonzero(predictions.scores >= threshold)
    kept = kept[np.isfinite(predictions.corners[kept]).all(axis=1)]
    kept = kept[np.argsort(-predictions.scores[kept], kind="stable")]
    scores, class_scores = predictions.scores[kept], predictions.class_scores[kept]
    probabilities = calibration.distribution(scores, class_scores)
    return Boxes(predictions.corners[kept], scores, class_scores, probabilities)


def joined(found: Sequence[Boxes], classes: int) -> Boxes:
    """Boxes of several parts or networks, best first; of none, no boxes of so many classes."""
    none = Boxes(*(np.zeros((0, *shape)) for shape in ((4,), (), (classes,), (classes,))))
    names = ("corners_px", "scores", "class_scores", "probabilities")
    every = [none, *found]
    boxes = Boxes(*(np.concatenate([getattr(one, name) for one in every]) for name in names))
    return boxes.selected(np.argsort(-boxes.scores, kind="stable").astype(np.int32))


def in_picture(boxes: Boxes, fit: Fit) -> Boxes:
    """Boxes of the network's input as boxes of the picture, without those beside it."""
    moved = replace(boxes, corners_px=fit.to_picture(boxes.corners_px))
    sides = moved.corners_px[:, 2:] - moved.corners_px[:, :2]
    return moved.selected(np.flatnonzero(sides.min(axis=1) >= _least_side).astype(np.int32))


def suppressed(boxes: Boxes) -> Boxes:
    """One box for each object: non-maximum suppression in each class, then across classes."""
    boxes = boxes.selected(_survivors(boxes, boxes.classes, class_overlap))
    return boxes.selected(_survivors(boxes, np.zeros_like(boxes.classes), any_overlap))


def _survivors(boxes: Boxes, groups: Ints, overlap: float) -> Ints:
    """Indices that stay, ascending, so that the order by score stays too."""
    if not len(boxes.scores):
        return np.zeros(0, np.int32)
    low, high = boxes.corners_px[:, :2], boxes.corners_px[:, 2:]
    left_top_size = np.concatenate([low, high - low], axis=1)
    # The threshold was applied before; below zero, a score of exactly zero survives too.
    kept = cv2.dnn.NMSBoxesBatched(
        left_top_size.tolist(), boxes.scores.tolist(), groups.tolist(), -1.0, overlap
    )
    return np.sort(np.asarray(kept, np.int32).reshape(-1))
