"""Fills in a detector's card: how good the weights are when OpenCV runs them."""

from pathlib import Path

import msgspec
import numpy as np

from services.perception.calibration import calibration_error, fit, reliability
from services.perception.card import DetectorCard, write_card
from services.perception.detector import Detector
from services.perception.training.evaluation import (
    Labelled,
    class_precisions,
    near_only,
    outcomes,
    overlap_thresholds,
)
from services.perception.training.frames import Frame

_lowest_score = 0.02
"""Average precision needs the whole curve, not only the boxes that the robot acts on."""


def measured(card: DetectorCard, weights: Path, held_out: list[Frame]) -> DetectorCard:
    """Fill in precision and calibration, measured through OpenCV, and write the card."""
    write_card(card, weights)
    pictures = labelled(Detector(weights, threshold=_lowest_score), held_out)
    precisions = np.array(
        [class_precisions(pictures, len(card.classes), t) for t in overlap_thresholds]
    )
    near = class_precisions([near_only(p) for p in pictures], len(card.classes), 0.5)
    # Fitted on one half of the pictures and judged on the other.
    calibration = fit(*outcomes(pictures[::2]))
    scores, class_scores, on_object, true_classes = outcomes(pictures[1::2])
    distribution = calibration.distribution(scores, class_scores)
    named = distribution.argmax(axis=1)
    table = reliability(distribution.max(axis=1), on_object & (named == true_classes))
    card = msgspec.structs.replace(
        card,
        validation_frames=len(held_out),
        map50=float(np.nanmean(precisions[0])),
        map50_95=float(np.nanmean(precisions)),
        average_precision50=dict(zip(card.classes, precisions[0].tolist(), strict=True)),
        near_average_precision50=dict(zip(card.classes, near.tolist(), strict=True)),
        calibration=calibration,
        reliability=tuple(table),
        calibration_error=calibration_error(table),
    )
    write_card(card, weights)
    return card


def labelled(detector: Detector, frames: list[Frame]) -> list[Labelled]:
    """What the detector finds in each frame beside what is there."""
    return [
        Labelled(
            detector.detect(frame.color),
            frame.boxes.astype(np.float64),
            frame.classes.astype(np.int32),
        )
        for frame in frames
    ]
