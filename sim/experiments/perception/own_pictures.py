"""`bench perception --images FOLDER`: a person's own pictures, of which nothing is known."""

import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from schemas.errors import UserError
from services.perception.camera.source import CameraSource, CameraSourceError, open_source
from services.perception.detection.boxes import Boxes
from services.perception.fiducials import TagReader
from sim.experiments.perception.networks import Networks
from sim.experiments.perception.progress import counting
from sim.experiments.perception.resampling import quantile_interval
from sim.experiments.perception.sheet import Drawn, draw_sheet
from sim.experiments.report import Failures, Outcome, Row, Settings

Found = TypeVar("Found")
MOST_DRAWN = 24


@dataclass(frozen=True)
class Look:
    """What one picture shows, and how long that took [ms]."""

    color: NDArray[np.uint8]
    """(H, W, 3) RGB."""
    boxes: Boxes
    tags: int
    detector_ms: float
    tags_ms: float


def measure_pictures(images: Path, networks: Networks, settings: Settings) -> Outcome:
    """Times and counts; the figure is a sheet of the pictures with what was found.

    Raises:
        UserError: there is no picture.
    """
    refused: Counter[str] = Counter()
    looks: list[Look] = []
    reader = TagReader()
    source = open_source(str(images))
    with closing(source), counting("looking", None) as progress:
        for picture in _pictures(source, settings.runs, refused):
            looks.append(_look(picture, networks, reader))
            progress(len(looks))
    if not looks:
        raise UserError(f"--images {images}: no picture could be read; {dict(refused)}")
    failures: Failures = {"pictures": dict(refused)} if refused else {}
    rng = np.random.default_rng(settings.seed)
    drawn = [Drawn(look.color, look.boxes, networks.working.classes) for look in _some(looks)]
    return Outcome(
        rows=tuple(_rows(looks, networks.working.classes, rng)),
        failures=failures,
        settings=(*networks.told, f"{len(looks)} pictures of {images}", *_times_of),
        draw=lambda report, path: draw_sheet(drawn, path),
    )


_times_of = ("times are those of the processor, one thread; of what was found nobody knows if it"
             " is true",)  # fmt: skip


def _pictures(
    source: CameraSource, most: int, refused: Counter[str]
) -> Iterator[NDArray[np.uint8]]:
    """Pictures of a folder, a video or a file; what is no picture is counted."""
    for _ in range(most):
        try:
            picture = source.picture()
        except CameraSourceError as error:
            refused[str(error)] += 1
            continue
        if picture is None:
            return
        yield picture


def _look(color: NDArray[np.uint8], networks: Networks, reader: TagReader) -> Look:
    boxes, detector_ms = _timed(lambda: networks.working.detect(color))
    (numbers, _), tags_ms = _timed(lambda: reader.read(color))
    return Look(color, boxes, len(numbers), detector_ms, tags_ms)


def _timed(call: Callable[[], Found]) -> tuple[Found, float]:
    started = time.process_time()
    value = call()
    return value, 1e3 * (time.process_time() - started)


def _some(looks: Sequence[Look]) -> list[Look]:
    """Pictures spread over all of them."""
    step = max(1, -(-len(looks) // MOST_DRAWN))
    return list(looks[::step])


def _rows(looks: Sequence[Look], classes: tuple[str, ...], rng: Generator) -> Iterator[Row]:
    times = {
        "detector": np.array([look.detector_ms for look in looks]),
        "tags": np.array([look.tags_ms for look in looks]),
    }
    for name, spent in times.items():
        for q in (0.5, 0.95):
            yield Row(
                row=f"own pictures, {name}",
                metric=f"time, p{100 * q:g}",
                unit="ms",
                better="lower",
                ours=float(np.quantile(spent, q)),
                interval=quantile_interval(spent, q, rng),
            )
    found = Counter(index for look in looks for index in look.boxes.classes.tolist())
    for index, count in found.most_common():
        yield _count(f"own pictures, {classes[index]}", count)
    yield _count("own pictures, tags", sum(look.tags for look in looks))


def _count(row: str, count: int) -> Row:
    return Row(
        row=row, metric="found", unit="", better="higher", ours=count, interval=(count, count)
    )
