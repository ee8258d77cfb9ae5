"""How good a detector is on labelled pictures: average precision and calibration."""

from dataclasses import dataclass

import numpy as np

from schemas.arrays import Flags, Floats, Ints
from services.perception.boxes import Boxes

overlap_thresholds: tuple[float, ...] = tuple(np.arange(0.5, 0.96, 0.05).round(2).tolist())

near_side = 24.0
"""Longer side from which an object counts as near [px]: a hydrant at 7 m, the end of the depth."""


@dataclass(frozen=True)
class Labelled:
    """What was found in one picture, and what was there."""

    found: Boxes
    true_boxes: Floats
    """(G, 4) x0 y0 x1 y1 [px]."""
    true_classes: Ints
    """(G,)"""


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


def average_precision(scores: Floats, correct: Flags, positives: int) -> float:
    """Area under the interpolated precision-recall curve; not a number without positives."""
    if positives == 0:
        return float("nan")
    hits = correct[np.argsort(-scores, kind="stable")]
    true_count = np.cumsum(hits)
    recall = np.concatenate([[0.0], true_count / positives])
    precision = true_count / np.arange(1, len(hits) + 1)
    envelope = np.maximum.accumulate(precision[::-1])[::-1]
    return float((np.diff(recall) * envelope).sum())


def class_precisions(pictures: list[Labelled], classes: int, threshold: float) -> Floats:
    """Average precision (C,) of each class at one overlap threshold."""
    return np.array([_one_class(pictures, index, threshold) for index in range(classes)])


def near_only(picture: Labelled) -> Labelled:
    """The picture without small objects, small boxes, and boxes on small objects.

    A box on a small object is neither right nor wrong: it was not asked for.
    """
    found, near = picture.found, _is_near(picture.true_boxes)
    small = picture.true_boxes[~near]
    on_small = (overlap_matrix(found.corners_px, small) >= 0.5).any(axis=1)
    kept = _is_near(found.corners_px) & ~on_small
    return Labelled(found.selected(kept), picture.true_boxes[near], picture.true_classes[near])


def _is_near(boxes: Floats) -> Flags:
    return (boxes[:, 2:] - boxes[:, :2]).max(axis=1) >= near_side


def outcomes(pictures: list[Labelled]) -> tuple[Floats, Floats, Flags, Ints]:
    """Scores, class scores, whether on an object of any class, and its class, of all boxes."""
    on_object: list[Ints] = []
    for picture in pictures:
        index = matches(picture.found.corners_px, picture.true_boxes, 0.5)
        padded = np.append(picture.true_classes, -1)
        on_object.append(padded[index].astype(np.int32))
    true_classes = np.concatenate(on_object)
    scores = np.concatenate([picture.found.scores for picture in pictures])
    class_scores = np.concatenate([picture.found.class_scores for picture in pictures])
    return scores, class_scores, true_classes >= 0, true_classes


def _one_class(pictures: list[Labelled], index: int, threshold: float) -> float:
    scores: list[Floats] = []
    correct: list[Flags] = []
    positives = 0
    for picture in pictures:
        chosen = picture.found.classes == index
        true_boxes = picture.true_boxes[picture.true_classes == index]
        scores.append(picture.found.scores[chosen])
        correct.append(matches(picture.found.corners_px[chosen], true_boxes, threshold) >= 0)
        positives += len(true_boxes)
    return average_precision(np.concatenate(scores), np.concatenate(correct), positives)
