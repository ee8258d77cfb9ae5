"""Runs the networks over pictures whose truth is known, once, and keeps what the figures need."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from schemas.arrays import Ints
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


def found_in(
    frames: FrameSet, networks: Networks, forms: Forms, progress: Callable[[int], None]
) -> Found:
    """Look at every frame; `progress` is told how many are done."""
    classes, scenes = networks.working.classes, list[int]()
    recogniser = Recogniser(networks.working, forms, RANGE_MAX)
    faint, working, placings = list[Labelled](), list[Labelled](), list[Placings]()
    for number, known in enumerate(frames):
        faint.append(labelled(networks.faint.detect(known.frame.color), known, classes))
        seen = recogniser.recognised(known.frame)
        working.append(labelled(seen.boxes, known, classes))
        placings.append(placings_in(number, known, seen.detections))
        scenes.append(known.scene)
        progress(number + 1)
    numbers = np.array(scenes, np.int32)
    figures = BoxFigures(classes, faint, numbers)
    return Found(frames, figures, working, joined(placings), numbers)
