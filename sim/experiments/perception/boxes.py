"""What the boxes that a network finds really were: precision curves and reliability."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from schemas.arrays import Flags, Floats, Ints
from services.perception.detection.boxes import Boxes
from services.perception.detection.calibration import ReliabilityBin, reliability
from services.perception.training.detector.evaluation import (
    Labelled,
    Ranked,
    near_only,
    outcomes,
    overlap_thresholds,
    ranked,
)
from sim.experiments.perception.frames import KnownFrame

HALF = overlap_thresholds.index(0.5)


@dataclass(frozen=True)
class BoxFigures:
    """What faint and strong boxes in P pictures really were."""

    classes: tuple[str, ...]
    pictures: Sequence[Labelled]
    scenes: Ints
    """(P,)"""

    @cached_property
    def tables(self) -> list[list[Ranked]]:
        """Of each class that the pictures show, at each overlap threshold."""
        return [
            [ranked(self.pictures, self.classes.index(name), overlap)
             for overlap in overlap_thresholds]
            for name in self.shown
        ]  # fmt: skip

    @cached_property
    def shown(self) -> tuple[str, ...]:
        """Classes of the network that the pictures show."""
        there = {int(index) for picture in self.pictures for index in picture.true_classes}
        return tuple(name for index, name in enumerate(self.classes) if index in there)

    @cached_property
    def near(self) -> list[Ranked]:
        """As `tables` at an overlap of a half, of objects of a certain size in the picture."""
        pictures = [near_only(picture) for picture in self.pictures]
        return [ranked(pictures, self.classes.index(name), 0.5) for name in self.shown]

    @cached_property
    def claims(self) -> "Claims":
        """All boxes that are not on ignored objects, faint ones too."""
        judged = [outcomes([picture]) for picture in self.pictures]
        sizes = [len(one.true_classes) for one in judged]
        tops = [one.boxes.probabilities.max(axis=1, initial=0.0) for one in judged]
        return Claims(
            pictures=np.repeat(np.arange(len(judged)), sizes).astype(np.int32),
            probabilities=np.concatenate(tops),
            scores=np.concatenate([one.boxes.scores for one in judged]),
            correct=np.concatenate([one.correct for one in judged]),
        )


@dataclass(frozen=True)
class Claims:
    """N boxes as claims that an object of a class is there."""

    pictures: Ints
    """(N,) which picture each box is in."""
    probabilities: Floats
    """(N,) of the class that it names."""
    scores: Floats
    """(N,)"""
    correct: Flags
    """(N,)"""

    @property
    def reliability(self) -> list[ReliabilityBin]:
        """Probabilities beside how often they are right."""
        return reliability(self.probabilities, self.correct)

    def calibration_error(self, weights: Floats | None = None, bins: int = 10) -> float:
        """Mean gap between probability and frequency; `weights` (P,) are of the pictures."""
        counts = np.ones(len(self.scores)) if weights is None else weights[self.pictures]
        index = np.minimum((self.probabilities * bins).astype(int), bins - 1)
        gaps = np.bincount(index, counts * (self.probabilities - self.correct), bins)
        return float(np.abs(gaps).sum() / max(float(counts.sum()), 1e-9))


def labelled(found: Boxes, known: KnownFrame, classes: tuple[str, ...]) -> Labelled:
    """What is found beside what is there; objects of classes that are not known are scenery."""
    rows = [row for row, label in enumerate(known.labels) if label in classes]
    boxes, ignored = known.boxes[rows], known.ignored[rows]
    named = np.array([classes.index(known.labels[row]) for row in rows], np.int32)
    return Labelled(
        found=found,
        true_boxes=boxes[~ignored],
        true_classes=named[~ignored],
        ignored_boxes=boxes[ignored],
    )
