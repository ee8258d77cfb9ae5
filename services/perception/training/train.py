"""From labelled pictures to the weights and card that the detector loads."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import torch
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from services.perception.calibration import Calibration
from services.perception.card import DetectorCard, file_sha256
from services.perception.training.export import export_network
from services.perception.training.frames import Frame, batches, read_frames
from services.perception.training.loop import Training
from services.perception.training.measurement import measured

_batch = 16
_checkpoint_every_s = 60.0
default_classes = ("cone", "hydrant", "barrel", "tree", "car", "building")


@dataclass(frozen=True)
class Recipe:
    """What the card says about how the weights were made."""

    classes: tuple[str, ...] = default_classes
    data: str = "random outdoor scenes rendered by sim.dataset, 320x240 px, boxes of visible parts"
    licence: str = "Apache-2.0"
    seed: int = 0


def train_detector(
    data_dir: Path,
    out_dir: Path,
    epochs: int = 12,
    minutes: float | None = None,
    resume: bool = True,
    progress: bool = True,
    recipe: Recipe | None = None,
    threads: int = 1,
) -> dict[str, Any]:
    """Train on `data_dir/train`, measure on `data_dir/val`, write weights and card to `out_dir`.

    Args:
        data_dir: Two data sets as `services.perception.training.frames` describes; the checkpoint
            is kept there too.
        out_dir: Gets `detector.onnx` and `detector.json`.
        epochs: Passes over the training pictures in all, earlier calls included.
        minutes: Ends this call early; a later one with `resume` goes on.
        resume: Continue from the checkpoint if there is one.
        progress: Show a bar on stderr.
        recipe: Classes, seed and words for the card.
        threads: Of the processor; a GPU is used if torch sees one.

    Returns:
        The card as a plain dict.

    Raises:
        PerceptionError: the pictures are missing.
    """
    recipe = recipe or Recipe()
    torch.set_num_threads(threads)
    frames, held_out = read_frames(data_dir / "train"), read_frames(data_dir / "val")
    training, checkpoint = Training(len(recipe.classes), recipe.seed), data_dir / "checkpoint.pt"
    if resume and checkpoint.exists():
        training.load(checkpoint)
    _learn(training, frames, epochs * len(frames), minutes, checkpoint, progress)
    out_dir.mkdir(parents=True, exist_ok=True)
    weights = out_dir / "detector.onnx"
    export_network(training.average.cpu(), weights)
    card = measured(_unmeasured(training, weights, recipe, len(frames)), weights, held_out)
    return msgspec.to_builtins(card)


def _learn(
    training: Training,
    frames: list[Frame],
    total: int,
    minutes: float | None,
    checkpoint: Path,
    progress: bool,
) -> None:
    stream, began, saved = batches(frames, _batch, training.rng), time.monotonic(), time.monotonic()
    with _bar(progress) as bar:
        task = bar.add_task("training", total=total, completed=training.pictures_seen, loss=0.0)
        while training.pictures_seen < total:
            loss = training.step(next(stream), total)
            bar.update(task, completed=training.pictures_seen, loss=loss)
            now = time.monotonic()
            if now - saved > _checkpoint_every_s:
                training.save(checkpoint)
                saved = now
            if minutes is not None and now - began > 60 * minutes:
                break
    training.save(checkpoint)


def _unmeasured(
    training: Training, weights: Path, recipe: Recipe, training_frames: int
) -> DetectorCard:
    """The card without figures, so that the detector that is measured is the one that will run."""
    return DetectorCard(
        classes=recipe.classes,
        sha256=file_sha256(weights),
        licence=recipe.licence,
        data=recipe.data,
        training_frames=training_frames,
        validation_frames=0,
        seed=recipe.seed,
        pictures_seen=training.pictures_seen,
        parameters=sum(parameter.numel() for parameter in training.network.parameters()),
        map50=0.0,
        map50_95=0.0,
        average_precision50={},
        near_average_precision50={},
        calibration=Calibration(),
        reliability=(),
        calibration_error=0.0,
    )


def _bar(visible: bool) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("pictures, loss {task.fields[loss]:.2f},"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        disable=not visible,
    )
