"""One or several detectors as one, as the paper ran sixteen of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Floats, Ints
from schemas.run import RunConfig
from services.perception.detection.boxes import Boxes, joined, suppressed
from services.perception.detection.detector import Detector
from services.perception.detection.gaze import EVERYTHING, Gaze
from services.perception.errors import DetectorFileError


class FindsObjects(Protocol):
    """What finds boxes in pictures."""

    @property
    def classes(self) -> tuple[str, ...]:
        """Names of the C classes."""
        ...

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        """Classes of each network."""
        ...

    def detect(self, color: NDArray[np.uint8], gaze: Gaze = EVERYTHING) -> Boxes:
        """Boxes in what is looked at of an RGB picture (H, W, 3)."""
        ...

    def pixels(self, width: int, height: int, gaze: Gaze = EVERYTHING) -> int:
        """Of the networks' inputs that a look at a picture of `width` x `height` px takes."""
        ...

    def looked_at(self, width: int, height: int, gaze: Gaze = EVERYTHING) -> Floats:
        """Parts (R, 4) x0 y0 x1 y1 [px] of a picture of `width` x `height` px that are shown."""
        ...


@dataclass(frozen=True)
class DetectorBank:
    """Runs every detector on every picture; classes of one name are one class.

    The scores of two networks do not compare, so here a box's score is its calibrated probability.
    """

    detectors: Sequence[FindsObjects]

    @property
    def classes(self) -> tuple[str, ...]:
        """Names of all, each once, in the order in which they first come."""
        return tuple(dict.fromkeys(name for one in self.detectors for name in one.classes))

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        """Classes of each network."""
        return tuple(one.classes for one in self.detectors)

    def detect(self, color: NDArray[np.uint8], gaze: Gaze = EVERYTHING) -> Boxes:
        """Boxes in an RGB picture (H, W, 3); of several on one object the most probable."""
        run = self._run(gaze)
        found = [self._renamed(one.detect(color, gaze), one.classes) for one in run]
        return suppressed(joined(found, len(self.classes)))

    def pixels(self, width: int, height: int, gaze: Gaze = EVERYTHING) -> int:
        """Of the networks' inputs that a look at a picture of `width` x `height` px takes."""
        return sum(one.pixels(width, height, gaze) for one in self._run(gaze))

    def looked_at(self, width: int, height: int, gaze: Gaze = EVERYTHING) -> Floats:
        """Parts (R, 4) [px] of a picture of `width` x `height` px that any network is shown."""
        shown = [one.looked_at(width, height, gaze) for one in self._run(gaze)]
        return np.unique(np.concatenate([np.zeros((0, 4)), *shown]), axis=0)

    def _run(self, gaze: Gaze) -> list[FindsObjects]:
        return [one for number, one in enumerate(self.detectors) if gaze.runs(number)]

    def _renamed(self, boxes: Boxes, classes: tuple[str, ...]) -> Boxes:
        merged = self.classes
        target = np.array([merged.index(name) for name in classes], np.int32)
        probabilities = _summed(boxes.probabilities, target, len(merged))
        class_scores = np.zeros_like(probabilities)
        np.maximum.at(class_scores.T, target, boxes.class_scores.T)
        return Boxes(boxes.corners_px, probabilities.max(axis=1), class_scores, probabilities)


def detector_of(run: RunConfig) -> FindsObjects:
    """The detectors that a run asks for; ours if it asks for none.

    Raises:
        DetectorFileError: a network or its class names cannot be used.
        MissingWeightsError: our own weights or their card are missing or do not belong together.
    """
    if not run.detectors:
        return Detector()
    return DetectorBank(user_detectors(run.detectors, run.detector_classes))


def user_detectors(
    weights: Sequence[str], class_files: Sequence[str], threshold: float | None = None
) -> list[Detector]:
    """Detectors from files, each with a class file of its own, or all without.

    Each has its own working threshold unless one is given.

    Raises:
        DetectorFileError: a file cannot be used, or there are not as many class files as networks.
    """
    if class_files and len(class_files) != len(weights):
        raise DetectorFileError(
            f"{len(weights)} detectors and {len(class_files)} class files; "
            "allowed: a class file for each, in the same order, or none"
        )
    files: list[Path | None] = [Path(file) for file in class_files]
    pairs = zip(weights, files or [None] * len(weights), strict=True)
    return [Detector(Path(file), class_file, threshold) for file, class_file in pairs]


def _summed(values: Floats, target: Ints, count: int) -> Floats:
    """Columns (N, C) added up into columns (N, `count`) that `target` (C,) names."""
    total = np.zeros((len(values), count))
    np.add.at(total.T, target, values.T)
    return total
