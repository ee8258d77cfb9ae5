"""From a network's outputs in any known layout to boxes in the pixels of its input."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Floats
from services.perception.detection.layouts import Layout, Outputs, Recognised, cell_grid, strides_of
from services.perception.errors import DetectorFileError

_largest_log = 9.0
"""Of a side in strides: nothing is larger, and nothing overflows."""


@dataclass(frozen=True)
class Predictions:
    """All that a network says of one picture, before anything is left out."""

    corners: Floats
    """(N, 4) x0 y0 x1 y1 in the input [px]."""
    scores: Floats
    """(N,) in [0, 1]: that the box is on an object, and on one of its best class."""
    class_scores: Floats
    """(N, C) in [0, 1]."""


@dataclass(frozen=True)
class Decoder:
    """Reads the outputs of one network."""

    found: Recognised
    classes: int
    width: int
    """Of the input [px]."""
    height: int

    def __call__(self, outputs: Outputs) -> Predictions:
        """Predictions of one picture.

        Raises:
            DetectorFileError: a class was named that has no name.
        """
        layout = self.found.layout
        if layout is Layout.MAPS:
            return self._maps(outputs)
        if layout is Layout.CORNERS_AND_SCORES:
            sides = np.array([self.width, self.height] * 2, float)
            return _scored(outputs[0].reshape(-1, 4) * sides, 1.0, outputs[1][0])
        table = next(output[0] for output in outputs if output.ndim == 3)
        rows = table.T if self.found.transposed else table
        if layout is Layout.END_TO_END:
            return self._end_to_end(rows)
        if layout is Layout.CLASS_SCORES:
            return _scored(_corners(rows), 1.0, rows[:, 4 : 4 + self.classes])
        if layout is Layout.CELL_OFFSETS:
            return self._offsets(rows, strides_of(len(rows), self.width, self.height))
        return self._with_objectness(_corners(rows), rows[:, 4:])

    def _maps(self, outputs: Outputs) -> Predictions:
        ordered = sorted(outputs, key=lambda output: -output.shape[2])
        rows = np.concatenate([output[0].reshape(len(output[0]), -1).T for output in ordered])
        return self._offsets(rows, [self.height // output.shape[2] for output in ordered])

    def _offsets(self, rows: NDArray[np.float32], strides: Sequence[int]) -> Predictions:
        cells, sizes = cell_grid(tuple(strides), self.width, self.height)
        middles = cells + rows[:, :2] * sizes
        sides = np.exp(np.minimum(rows[:, 2:4], _largest_log)) * sizes
        boxes = _corners(np.concatenate([middles, sides], axis=1))
        return self._with_objectness(boxes, rows[:, 4:])

    def _with_objectness(self, corners: Floats, scores: NDArray[np.float32]) -> Predictions:
        certain = _sigmoid(scores) if self.found.logits else scores
        return _scored(corners, certain[:, 0], certain[:, 1:])

    def _end_to_end(self, rows: NDArray[np.float32]) -> Predictions:
        # Rows that stand for nothing have a score of zero, and sometimes no class either.
        rows = rows[rows[:, 4] > 0]
        named = rows[:, 5].astype(np.intp)
        if len(named) and not (named.min() >= 0 and named.max() < self.classes):
            raise DetectorFileError(
                f"the network named class {named.max()}, counted from 0, "
                f"but {self.classes} names are known"
            )
        class_scores = np.zeros((len(rows), self.classes))
        class_scores[np.arange(len(rows)), named] = rows[:, 4]
        return _scored(rows[:, :4], 1.0, class_scores)


def _scored(
    corners: NDArray[Any], objectness: NDArray[Any] | float, of_class: NDArray[Any]
) -> Predictions:
    class_scores = of_class.astype(np.float64)
    scores = objectness * class_scores.max(axis=1, initial=0.0)
    return Predictions(corners.astype(np.float64), scores, class_scores)


def _corners(rows: NDArray[Any]) -> Floats:
    """Corner boxes of rows that begin with the middle and the sides."""
    middle, half = rows[:, :2].astype(np.float64), rows[:, 2:4].astype(np.float64) / 2
    return np.concatenate([middle - half, middle + half], axis=1)


def _sigmoid(values: NDArray[np.float32]) -> Floats:
    return 1 / (1 + np.exp(-values.astype(np.float64)))
