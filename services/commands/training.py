"""Verbs that learn from the data in the tree."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from schemas.errors import MissingComponentError
from services.commands.output import print_json

FRAMES = {"train": (3000, 0), "val": (300, 1)}
"""Rendered pictures and seed of each part of the detector's data."""


def train(
    what: Annotated[Literal["grounding", "detector"], tyro.conf.Positional],
    robot: str = "husky",
    data: Path = Path("runs/detector-data"),
    epochs: int = 12,
    minutes: float | None = None,
    json: bool = False,
) -> int:
    """Train from our own data; writes the weights and a report with held-out figures.

    Args:
        what: grounding: words of one robot, seconds; detector: the camera's network, about an hour.
        robot: whose words (grounding).
        data: folder for rendered pictures (detector); made if it is not there, resumed if it is.
        epochs: passes over the pictures in all (detector).
        minutes: ends this call early (detector); called again, it goes on from where it was.
        json: one JSON document on stdout.
    """
    report = _grounding(robot) if what == "grounding" else _detector(data, epochs, minutes)
    if json:
        print_json(report)
    else:
        for name, value in report.items():
            print(f"{name}: {value}")
    return 0


def _bar() -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
    )


def _grounding(robot: str) -> dict[str, Any]:
    from services.grounding.training.train import train_grounding

    with _bar() as bar:
        task = bar.add_task("training", total=1.0)

        def progress(doing: str, share: float) -> None:
            bar.update(task, description=doing, completed=share)

        return train_grounding(robot, progress)


def _detector(data: Path, epochs: int, minutes: float | None) -> dict[str, Any]:
    from services.doctor.checks import training_remedy
    from services.perception.detector import default_weights

    if find_spec("torch") is None or find_spec("onnx") is None:
        raise MissingComponentError(f"training needs torch and onnx: {training_remedy()}")
    _render(data)
    from services.perception.training.train import train_detector

    return train_detector(data, default_weights.parent, epochs=epochs, minutes=minutes)


def _render(data: Path) -> None:
    from sim import vulkan

    vulkan.activate()
    from sim.dataset import write_dataset

    with _bar() as bar:
        for part, (count, seed) in FRAMES.items():
            task = bar.add_task(f"rendering {part}", total=count)

            def progress(done: int, total: int, task: Any = task) -> None:
                bar.update(task, completed=done, total=total)

            write_dataset(data / part, count, seed, progress=progress)
