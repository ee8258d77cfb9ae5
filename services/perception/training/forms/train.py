"""From rendered things to `forms.json`, with figures on held-out looks and scenes."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from services.perception.space.forms import Forms, write_forms
from services.perception.training.forms.data import examples_in
from services.perception.training.forms.fit import Example, learn_forms
from services.perception.training.forms.measurement import placings_of

SCENES = {"train": 400, "test": 150}
"""Rendered scenes of each set, of six pictures each."""
_streams = {"train": 5, "test": 6}

Progressed = Callable[[str, int, int], None]
"""Told the set, its scenes that are done, and how many there are."""


def train_forms(path: Path, progress: Progressed, seed: int = 0) -> dict[str, Any]:
    """Learn from the one set, measure on the other, write the file.

    Args:
        path: gets the forms.
        progress: told of every scene.
        seed: of scenes and noise.

    Returns:
        Counts and `placings`, as a plain dict.
    """
    learned = _examples("train", seed, progress)
    source = f"{len(learned)} objects of {SCENES['train']} scenes of sim.dataset, seed {seed}"
    table = learn_forms(learned, source)
    write_forms(table, path)
    judged = _examples("test", seed, progress)
    return {
        "forms": str(path),
        "learned_from": source,
        "classes": sorted(table.forms),
        "judged_by": len(judged),
        "placings": [msgspec.to_builtins(one) for one in placings_of(judged, Forms(table))],
    }


def _examples(part: str, seed: int, progress: Progressed) -> list[Example]:
    # sapien, and with it the driver, is needed by those alone who render.
    from sim.frames import FrameRenderer  # noqa: PLC0415
    from sim.scenes.training_parts import get_part  # noqa: PLC0415

    renderer, rng = FrameRenderer(), np.random.default_rng([seed, _streams[part]])
    found: list[Example] = []
    for scene in range(SCENES[part]):
        for truth in renderer.true_frames(get_part(part), seed, scene):
            found += examples_in(truth, rng)
        progress(part, scene + 1, SCENES[part])
    return found
