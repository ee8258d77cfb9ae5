"""The score from which the robot takes a box for an object."""

from collections.abc import Sequence

import numpy as np

from schemas.arrays import Flags, Floats
from services.perception.training.detector.evaluation import (
    Labelled,
    Outcomes,
    above,
    outcomes,
    overlap_matrix,
)

lowest, highest = 0.2, 0.8
"""Between these the threshold is chosen."""
most_from_nothing = 0.5
"""Boxes on nothing at all that a hundred pictures may hold; asked is one."""
_on_nothing = 0.1
"""A box that overlaps every object by less than this (IoU) is on nothing; others are misplaced."""


def working_threshold(pictures: Sequence[Labelled]) -> float:
    """Best balance of finding and not inventing, on pictures that no weight was fitted to.

    The threshold of the best F1 measure, or a higher one where boxes on nothing would still be
    too many: a robot that sees things where there are none drives to them.
    """
    candidates = np.arange(lowest, highest, 0.01)
    judged, positives = outcomes(pictures), sum(len(one.true_classes) for one in pictures)
    balance = [_f1(judged, positives, threshold) for threshold in candidates]
    inventions = np.sort(np.concatenate([_inventions(picture) for picture in pictures]))[::-1]
    allowed = int(most_from_nothing * len(pictures) / 100)
    least = float(inventions[allowed]) if len(inventions) > allowed else lowest
    return float(np.clip(max(candidates[int(np.argmax(balance))], least + 0.01), lowest, highest))


def precision_and_recall(pictures: Sequence[Labelled], threshold: float) -> tuple[float, float]:
    """Of boxes that reach the threshold, at an overlap of 0.5."""
    judged = outcomes([above(picture, threshold) for picture in pictures])
    positives = sum(len(picture.true_classes) for picture in pictures)
    right = int(judged.correct.sum())
    return right / max(len(judged.correct), 1), right / max(positives, 1)


def found_per_hundred(pictures: Sequence[Labelled], threshold: float) -> float:
    """Boxes that reach the threshold in a hundred pictures."""
    found = sum(int((picture.found.scores >= threshold).sum()) for picture in pictures)
    return 100 * found / max(len(pictures), 1)


def _f1(judged: Outcomes, positives: int, threshold: float) -> float:
    taken: Flags = judged.boxes.scores >= threshold
    return 2 * float((judged.correct & taken).sum()) / max(float(taken.sum()) + positives, 1.0)


def _inventions(picture: Labelled) -> Floats:
    """Scores of the boxes that are on nothing."""
    things = np.concatenate([picture.true_boxes, picture.ignored_boxes])
    touched = (overlap_matrix(picture.found.corners_px, things) >= _on_nothing).any(axis=1)
    return picture.found.scores[~touched]
