"""Random scenes for training and judging the detector."""

from __future__ import annotations

import numpy as np

from sim.scenes.training_indoor import indoor_scene
from sim.scenes.training_model import TrainingScene
from sim.scenes.training_outdoor import outdoor_scene
from sim.scenes.training_parts import Draw, Part

INDOOR_SHARE = 0.45


def random_scene(part: Part, seed: int, scene: int) -> tuple[TrainingScene, np.random.Generator]:
    """One scene of a set of pictures, and the generator that draws its views.

    The same arguments give the same scene; no other set has it.
    """
    rng = np.random.default_rng([part.stream, seed, scene])
    draw = Draw(part, rng)
    return (indoor_scene(draw) if rng.random() < INDOOR_SHARE else outdoor_scene(draw)), rng
