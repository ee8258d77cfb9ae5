"""Rows of the classifier of places, on rooms that it was not trained on."""

import time
from pathlib import Path

import numpy as np

from schemas.arrays import Flags, Floats, Ints
from services.perception.detection.calibration import calibration_error, reliability
from services.perception.places.card import PlacesCard
from services.perception.places.classifier import PlaceClassifier, default_places, softmax
from services.perception.training.places.frames import PlacePicture, read_places, write_places
from services.perception.training.places.measurement import Looks, even, looks_at
from sim import vulkan
from sim.experiments.perception.progress import counting
from sim.experiments.report import Row, Settings, rate_row

FIRST_SEED = 1000
"""Rooms are trained and calibrated on with seeds below this."""
MOST = 512
"""Pictures."""


def place_rows(settings: Settings, folder: Path) -> tuple[list[Row], list[str]]:
    """Rows, and what they hold for; none where there are no weights."""
    if not default_places.exists():
        return [], [f"places left out: {default_places.name} is missing; `train places` makes it"]
    seed, count = FIRST_SEED + settings.seed, min(settings.runs, MOST)
    home = folder / f"places-{seed}"
    vulkan.activate()
    with counting("rendering rooms", count) as progress:
        write_places(home, count, seed, lambda done, total: progress(done))
    pictures = read_places(home)
    classifier = PlaceClassifier()
    started = time.process_time()
    looks = looks_at(classifier, pictures)
    spent_ms = 1e3 * (time.process_time() - started) / len(pictures)
    rows = [*judged_rows(classifier.card, looks), _time(spent_ms, pictures)]
    return rows, [f"places: {len(pictures)} pictures of rendered rooms, seed {seed}"]


def judged_rows(card: PlacesCard, looks: Looks) -> list[Row]:
    """Of the place that the camera is in, of those ahead, and of those seen through doorways."""
    here = looks.pooled(card.here_temperature, card.pooling)
    logits, truth = looks.windows
    ahead = softmax(logits / card.ahead_temperature)
    through = np.where(looks.elsewhere, truth, -1).astype(np.int32)
    return [
        *_rows("place of the camera", here, looks.true_here),
        *_rows("place ahead", ahead, truth),
        *_rows("place through a doorway", ahead, through),
    ]


def _rows(name: str, probabilities: Floats, truth: Ints) -> list[Row]:
    """Types count evenly."""
    chosen = even(truth)
    if not len(chosen):
        return []
    right: Flags = (probabilities.argmax(axis=1) == truth)[chosen]
    error = calibration_error(reliability(probabilities.max(axis=1)[chosen], right))
    return [
        rate_row(name, "likeliest type is right", right.tolist()),
        Row(
            row=name,
            metric="calibration error",
            unit="",
            better="lower",
            ours=error,
            interval=(error, error),
        ),
    ]


def _time(spent_ms: float, pictures: list[PlacePicture]) -> Row:
    windows = len(pictures[0].windows)
    return Row(
        row=f"places, {windows} windows of a picture, one core",
        metric="mean time",
        unit="ms",
        better="lower",
        ours=spent_ms,
        interval=(spent_ms, spent_ms),
    )
