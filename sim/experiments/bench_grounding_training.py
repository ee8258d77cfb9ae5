"""Training every robot's grounding from nothing: how long it takes, and what it gives."""

import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from services.grounding.training.train import train_grounding
from sim.experiments.bench_grounding_scaling import trained_robots
from sim.experiments.report import Outcome, Row, Settings


def measure(settings: Settings) -> Outcome:
    """Training times of every robot; intervals span the shortest and the longest run."""
    return Outcome(tuple(row for robot in trained_robots() for row in _rows(robot, settings)))


def _rows(robot: str, settings: Settings) -> list[Row]:
    with TemporaryDirectory() as folder:
        times = [_seconds(robot, Path(folder), settings) for _ in range(settings.runs)]
    # Where others work on the same machine, the clock says more of them than of us.
    names = ("training from nothing", "training from nothing, processor time")
    return [
        Row(
            row=robot,
            metric=name,
            unit="s",
            better="lower",
            ours=median(seconds),
            interval=(min(seconds), max(seconds)),
        )
        for name, seconds in zip(names, zip(*times, strict=True), strict=True)
    ]


def _seconds(robot: str, folder: Path, settings: Settings) -> tuple[float, float]:
    """By the clock, and of the processor."""
    settings.progress(f"{robot}: training")
    started, worked = time.perf_counter(), time.process_time()
    train_grounding(robot, lambda _doing, _share: None, folder)
    return time.perf_counter() - started, time.process_time() - worked
