"""What `train places` does: renders rooms where pictures are missing, and learns from them."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

from schemas.errors import MissingComponentError
from services.commands.output import counting_bars

PICTURES = {"train": (4_096, 0), "val": (768, 1)}
"""Rendered pictures and seed of each part."""


def learn(data: Path, epochs: int, minutes: float | None) -> dict[str, Any]:
    """Render, train, measure; returns the card of the weights.

    Raises:
        MissingComponentError: torch or onnx, or a Vulkan device, is missing.
    """
    from services.doctor.checks import training_remedy
    from services.perception.places.classifier import default_places

    if find_spec("torch") is None or find_spec("onnx") is None:
        raise MissingComponentError(f"training needs torch and onnx: {training_remedy()}")
    _render(data)
    from services.perception.training.places.train import train_places

    return train_places(data, default_places.parent, epochs, minutes)


def _render(data: Path) -> None:
    from sim import vulkan

    vulkan.activate()
    from services.perception.training.places.frames import (
        contact_sheet,
        read_places,
        write_places,
    )

    with counting_bars() as bar:
        for part, (count, seed) in PICTURES.items():
            task = bar.add_task(f"rendering {part}", total=count)

            def progress(done: int, total: int, task: Any = task) -> None:
                bar.update(task, completed=done, total=total)

            write_places(data / part, count, seed, progress)
    contact_sheet(read_places(data / "val"), data / "sheet.png")
