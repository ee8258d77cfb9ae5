"""Fills in a detector's card: how good the weights are when OpenCV runs them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from services.perception.detection.calibration import calibration_error, fit, reliability
from services.perception.detection.card import DetectorCard
from services.perception.detection.detector import Detector
from services.perception.training.detector.evaluation import (
    Labelled,
    class_precisions,
    near_only,
    outcomes,
    overlap_thresholds,
)
from services.perception.training.detector.frames import Frame
from services.perception.training.detector.threshold import (
    found_per_hundred,
    precision_and_recall,
    working_threshold,
)
from services.perception.weight_files import write_card

_lowest_score = 0.02
"""Average precision needs the whole curve, not only the boxes that the robot acts on."""


@dataclass(frozen=True)
class HeldOut:
    """Pictures that no weight was trained on."""

    val: list[Frame]
    """Fit the calibration and the working threshold."""
    test: list[Frame]
    """Give the figures of the card."""
    empty: list[Frame]
    """Show none of the classes: whatever is found there is false."""


def measured(card: DetectorCard, weights: Path, held_out: HeldOut) -> DetectorCard:
    """Fit calibration and threshold, fill in the figures, and write the card."""
    card = _fitted(card, weights, held_out.val)
    write_card(card, weights)
    detector = Detector(weights, threshold=_lowest_score)
    pictures = labelled(detector, held_out.test)
    card = _with_figures(card, pictures)
    precision, recall = precision_and_recall(pictures, card.threshold)
    card = msgspec.structs.replace(
        card,
        precision=precision,
        recall=recall,
        empty_frames=len(held_out.empty),
        false_per_hundred=found_per_hundred(labelled(detector, held_out.empty), card.threshold),
    )
    write_card(card, weights)
    return card


def _fitted(card: DetectorCard, weights: Path, val: list[Frame]) -> DetectorCard:
    # A detector needs a card; what is fitted now takes no part in what is fitted to.
    write_card(card, weights)
    pictures = labelled(Detector(weights, threshold=_lowest_score), val)
    found = outcomes(pictures)
    boxes = found.boxes
    return msgspec.structs.replace(
        card,
        validation_frames=len(val),
        threshold=working_threshold(pictures),
        calibration=fit(boxes.scores, boxes.class_scores, found.on_object, found.true_classes),
    )


def _with_figures(card: DetectorCard, pictures: Sequence[Labelled]) -> DetectorCard:
    count = len(card.classes)
    precisions = np.array([class_precisions(pictures, count, t) for t in overlap_thresholds])
    near = class_precisions([near_only(picture) for picture in pictures], count, 0.5)
    found = outcomes(pictures)
    table = reliability(found.boxes.probabilities.max(axis=1), found.correct)
    return msgspec.structs.replace(
        card,
        test_frames=len(pictures),
        map50=float(np.nanmean(precisions[0])),
        map50_95=float(np.nanmean(precisions)),
        average_precision50=_by_name(card, precisions[0]),
        average_precision50_95=_by_name(card, precisions.mean(axis=0)),
        near_average_precision50=_by_name(card, near),
        reliability=tuple(table),
        calibration_error=calibration_error(table),
    )


def _by_name(card: DetectorCard, values: np.ndarray) -> dict[str, float]:
    """Figures of the classes that the pictures show."""
    pairs = zip(card.classes, values.tolist(), strict=True)
    return {name: value for name, value in pairs if np.isfinite(value)}


def labelled(detector: Detector, frames: list[Frame]) -> list[Labelled]:
    """What the detector finds in each frame beside what is there."""
    return [_labelled(detector, frame) for frame in frames]


def _labelled(detector: Detector, frame: Frame) -> Labelled:
    boxes, asked = frame.boxes.astype(np.float64), ~frame.ignored
    return Labelled(
        found=detector.detect(frame.color),
        true_boxes=boxes[asked],
        true_classes=frame.classes[asked].astype(np.int32),
        ignored_boxes=boxes[~asked],
    )
