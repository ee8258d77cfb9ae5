"""Runs the networks over pictures whose truth is known, once, and keeps what the figures need."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Ints
from services.perception.detection.boxes import Boxes
from services.perception.scene import Recogniser
from services.perception.space.forms import Forms
from services.perception.training.detector.evaluation import Labelled
from sim.experiments.perception.boxes import BoxFigures, labelled
from sim.experiments.perception.frames import FrameSet
from sim.experiments.perception.networks import Networks
from sim.experiments.perception.scene_files import RANGE_MAX
from sim.experiments.perception.space import Placings, joined, placings_in


@dataclass(frozen=True)
class Found:
    """What was found in P pictures, and what is in them."""

    frames: FrameSet
    faint: BoxFigures
    """All boxes, those below the working threshold too."""
    working: Sequence[Labelled]
    """P pictures with the boxes that the robot acts on."""
    placings: Placings
    scenes: Ints
    """(P,)"""


@dataclass(frozen=True)
class _Given:
    """Boxes that were found before, for what looks for them again."""

    classes: tuple[str, ...]
    boxes: Boxes

    def detect(self, color: NDArray[np.uint8]) -> Boxes:
        """The boxes, whatever the picture."""
        del color
        return self.boxes


def found_in(
    frames: FrameSet, networks: Networks, forms: Forms, progress: Callable[[int], None]
) -> Found:
    """Look at every frame; `progress` is told how many are done."""
    classes, scenes = networks.working.classes, list[int]()
    faint, working, placings = list[Labelled](), list[Labelled](), list[Placings]()
    for number, known in enumerate(frames):
        color = known.frame.color
        faint.append(labelled(networks.faint.detect(color), known, classes))
        boxes = networks.working.detect(color)
        working.append(labelled(boxes, known, classes))
        said, _ = Recogniser(_Given(classes, boxes), forms, RANGE_MAX).recognised(known.frame)
        placings.append(placings_in(number, known, said))
        scenes.append(known.scene)
        progress(number + 1)
    numbers = np.array(scenes, np.int32)
    figures = BoxFigures(classes, faint, numbers)
    return Found(frames, figures, working, joined(placings), numbers)
