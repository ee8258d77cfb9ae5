"""How good a detector is on labelled pictures: average precision and calibration."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from schemas.arrays import Flags, Floats, Ints
from services.perception.detection.boxes import Boxes

overlap_thresholds: tuple[float, ...] = tuple(np.arange(0.5, 0.96, 0.05).round(2).tolist())

near_side = 24.0
"""Longer side from which an object counts as near [px]: a hydrant at 7 m, the end of the depth."""
on_ignored = 0.3
"""A box is on an ignored object when they overlap by this (IoU): little is to be seen of it."""


@dataclass(frozen=True)
class Labelled:
    """What was found in one picture, and what was there."""

    found: Boxes
    true_boxes: Floats
    """(G, 4) x0 y0 x1 y1 [px]."""
    true_classes: Ints
    """(G,)"""
    ignored_boxes: Floats
    """(I, 4) of objects that need not be found, and that it is not wrong to find."""


@dataclass(frozen=True)
class Outcomes:
    """What N boxes really were."""

    boxes: Boxes
    true_classes: Ints
    """(N,) of the object each box is on; -1 where there is none."""

    @property
    def on_object(self) -> Flags:
        """(N,) whether a box is on an object of any class."""
        return self.true_classes >= 0

    @property
    def correct(self) -> Flags:
        """(N,) whether a box is on an object of the class it names."""
        return self.true_classes == self.boxes.classes


def overlap_matrix(a: Floats, b: Floats) -> Floats:
    """IoU (N, M) of boxes (N, 4) and (M, 4)."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, 2:], b[None, :, 2:])
    shared = np.clip(high - low, 0, None).prod(axis=2)
    areas = [(boxes[:, 2:] - boxes[:, :2]).prod(axis=1) for boxes in (a, b)]
    return shared / np.maximum(areas[0][:, None] + areas[1][None] - shared, 1e-9)


def matches(found: Floats, true_boxes: Floats, threshold: float) -> Ints:
    """Index (N,) of the object each box is on, -1 for none; best boxes choose first.

    Each object is taken at most once: a second box on it is a mistake.
    """
    overlap = overlap_matrix(found, true_boxes)
    result = np.full(len(found), -1, np.int32)
    for row in range(len(found) if len(true_boxes) else 0):
        column = int(overlap[row].argmax())
        if overlap[row, column] >= threshold:
            result[row] = column
            overlap[:, column] = -1.0
    return result


@dataclass(frozen=True)
class Ranked:
    """All N boxes of one class that P pictures show, best first, and whether they are right."""

    pictures: Ints
    """(N,) which picture each box is in."""
    scores: Floats
    """(N,)"""
    correct: Flags
    """(N,)"""
    positives: Ints
    """(P,) objects of the class in each picture."""

    def curve(self, weights: Floats | None = None) -> tuple[Floats, Floats]:
        """Recall and precision (N,) at the score of each box.

        `weights` (P,) let a picture count several times, or not at all.
        """
        each = np.ones(len(self.positives)) if weights is None else weights
        counts = each[self.pictures]
        right, taken = np.cumsum(counts * self.correct), np.cumsum(counts)
        return right / max(float(each @ self.positives), 1e-9), right / np.maximum(taken, 1e-9)

    def average_precision(self, weights: Floats | None = None) -> float:
        """Area under the interpolated precision-recall curve; not a number without positives."""
        each = np.ones(len(self.positives)) if weights is None else weights
        if each @ self.positives == 0:
            return float("nan")
        recall, precision = self.curve(weights)
        envelope = np.maximum.accumulate(precision[::-1])[::-1]
        return float((np.diff(recall, prepend=0.0) * envelope).sum())


def class_precisions(pictures: Sequence[Labelled], classes: int, threshold: float) -> Floats:
    """Average precision (C,) of each class at one overlap threshold."""
    return np.array(
        [ranked(pictures, index, threshold).average_precision() for index in range(classes)]
    )


def near_only(picture: Labelled) -> Labelled:
    """The picture without small boxes, its small objects being ignored."""
    near = _is_near(picture.true_boxes)
    return Labelled(
        found=picture.found.selected(_is_near(picture.found.corners_px)),
        true_boxes=picture.true_boxes[near],
        true_classes=picture.true_classes[near],
        ignored_boxes=np.concatenate([picture.ignored_boxes, picture.true_boxes[~near]]),
    )


def outcomes(pictures: Sequence[Labelled]) -> Outcomes:
    """What all boxes of all pictures really were; those on ignored objects are left out."""
    judged = [_judged(picture) for picture in pictures]
    columns = ("corners_px", "scores", "class_scores", "probabilities")
    boxes = Boxes(
        *(np.concatenate([getattr(one.boxes, name) for one in judged]) for name in columns)
    )
    return Outcomes(boxes, np.concatenate([one.true_classes for one in judged]))


def _judged(picture: Labelled) -> Outcomes:
    index = matches(picture.found.corners_px, picture.true_boxes, 0.5)
    kept = (index >= 0) | ~_excused(picture.found.corners_px, picture.ignored_boxes)
    true_classes = np.append(picture.true_classes, -1)[index].astype(np.int32)
    return Outcomes(picture.found.selected(kept), true_classes[kept])


def above(picture: Labelled, threshold: float) -> Labelled:
    """The picture with the boxes that reach a score."""
    return replace(picture, found=picture.found.selected(picture.found.scores >= threshold))


def ranked(pictures: Sequence[Labelled], index: int, threshold: float) -> Ranked:
    """The boxes of one class, judged at one overlap threshold, without those on ignored objects."""
    scores: list[Floats] = []
    correct: list[Flags] = []
    numbers: list[Ints] = []
    positives: list[int] = []
    for number, picture in enumerate(pictures):
        found = picture.found.selected(picture.found.classes == index)
        true_boxes = picture.true_boxes[picture.true_classes == index]
        right = matches(found.corners_px, true_boxes, threshold) >= 0
        judged = right | ~_excused(found.corners_px, picture.ignored_boxes)
        scores.append(found.scores[judged])
        correct.append(right[judged])
        numbers.append(np.full(int(judged.sum()), number, np.int32))
        positives.append(len(true_boxes))
    every = np.concatenate(scores)
    order = np.argsort(-every, kind="stable")
    return Ranked(
        pictures=np.concatenate(numbers)[order],
        scores=every[order],
        correct=np.concatenate(correct)[order],
        positives=np.array(positives, np.int32),
    )


def _excused(found: Floats, ignored: Floats) -> Flags:
    """(N,) whether a box is on an object that need not be found."""
    return overlap_matrix(found, ignored).max(axis=1, initial=0.0) >= on_ignored


def _is_near(boxes: Floats) -> Flags:
    return (boxes[:, 2:] - boxes[:, :2]).max(axis=1) >= near_side
