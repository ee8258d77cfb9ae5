"""Boxes in a camera picture, by a small network that OpenCV runs on one core."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Floats, Ints
from services.perception.card import DetectorCard, read_card
from services.perception.errors import PerceptionError
from services.perception.picture import input_height, input_width, network_input

default_weights = Path(__file__).parent / "weights" / "detector.onnx"
least_score = 0.25
"""Boxes below are noise: they cost the filter more than their rare truths are worth."""
class_overlap = 0.5
"""Of two boxes of one class that overlap by more than this (IoU) the lower score goes."""
any_overlap = 0.8
"""The same for boxes of different classes: one object, whose distribution already doubts."""


@dataclass(frozen=True)
class Boxes:
    """What the network found in one picture, best first."""

    corners_px: Floats
    """(N, 4) x0 y0 x1 y1, within the picture."""
    scores: Floats
    """(N,) confidence in [0, 1]; not a calibrated probability."""
    class_scores: Floats
    """(N, C) in [0, 1], each class by itself; rows do not sum to 1."""

    @property
    def classes(self) -> Ints:
        """(N,) index of the best class of each box."""
        return self.class_scores.argmax(axis=1).astype(np.int32)


class Network:
    """An ONNX file run by OpenCV: (1, 3, H, W) in, one output with decoded boxes."""

    def __init__(self, weights: Path) -> None:
        # Process-wide. One thread already gives 50 frames/s; more would only starve the others.
        cv2.setNumThreads(1)
        self._net = _loaded(weights)
        self._outputs: Sequence[str] = self._net.getUnconnectedOutLayersNames()

    def __call__(self, blob: NDArray[np.float32]) -> NDArray[np.float32]:
        """Output (N, 5 + C) for one blob: centre x, y, width, height [px], objectness, classes."""
        self._net.setInput(blob)
        (output,) = self._net.forward(self._outputs)
        return np.asarray(output[0], np.float32)


def _loaded(weights: Path) -> cv2.dnn.Net:
    refusal = f"OpenCV cannot load the network in {weights}"
    try:
        net = cv2.dnn.readNetFromONNX(str(weights), engine=cv2.dnn.ENGINE_NEW)
    except cv2.error as error:
        raise PerceptionError(refusal) from error
    # A file that is ONNX, but holds what the new engine cannot run, gives an empty net instead.
    if net.empty():
        raise PerceptionError(refusal)
    return net


class Detector:
    """Finds the objects of its card's classes in pictures of at most 320x256 px.

    Raises:
        PerceptionError: weights or card are missing or do not belong together.
    """

    def __init__(self, weights: Path = default_weights, threshold: float = least_score) -> None:
        self.card: DetectorCard = read_card(weights)
        self._network, self._threshold = Network(weights), threshold
        # The first forward pass allocates and packs weights: not while a robot waits for it.
        self._network(network_input(np.zeros((input_height, input_width, 3), np.uint8)))

    def detect(self, color: NDArray[np.uint8]) -> Boxes:
        """Boxes in an RGB picture (H, W, 3)."""
        height, width = color.shape[:2]
        predictions = self._network(network_input(color))
        return suppressed(candidates(predictions, self._threshold, width, height))


def candidates(
    predictions: NDArray[np.float32], threshold: float, width: int, height: int
) -> Boxes:
    """Predictions (N, 5 + C) that reach the threshold, as boxes cut at the picture's edge."""
    class_scores = predictions[:, 5:].astype(np.float64)
    scores = predictions[:, 4] * class_scores.max(axis=1)
    kept = np.flatnonzero(scores >= threshold)
    kept = kept[np.argsort(-scores[kept], kind="stable")]
    middle, half = predictions[kept, :2], predictions[kept, 2:4] / 2
    corners = np.concatenate([middle - half, middle + half], axis=1).astype(np.float64)
    corners = np.clip(corners, 0, [width, height, width, height])
    return Boxes(corners, scores[kept], class_scores[kept])


def suppressed(boxes: Boxes) -> Boxes:
    """One box for each object: non-maximum suppression in each class, then across classes."""
    boxes = _selected(boxes, _survivors(boxes, boxes.classes, class_overlap))
    return _selected(boxes, _survivors(boxes, np.zeros_like(boxes.classes), any_overlap))


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


def _selected(boxes: Boxes, index: Ints) -> Boxes:
    return Boxes(boxes.corners_px[index], boxes.scores[index], boxes.class_scores[index])
