"""From labelled pictures to the weights, card and report of the detector."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import torch
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from services.perception.detection.calibration import Calibration
from services.perception.detection.card import DetectorCard
from services.perception.training.detector.augmentation import augmented, mirrored, shuffled
from services.perception.training.detector.export import export_network
from services.perception.training.detector.frames import Frame, read_frames
from services.perception.training.detector.loop import Training
from services.perception.training.detector.measurement import HeldOut, measured
from services.perception.training.detector.report import data_set, training_report, write_report
from services.perception.weight_files import file_sha256
from sim.assets.library import DETECTED

_batch = 16
_calm_share = 0.1
"""Of the training, at its end, on pictures as they are."""
_checkpoint_every_s = 60.0


@dataclass(frozen=True)
class Recipe:
    """What the card says about how the weights were made."""

    classes: tuple[str, ...] = tuple(DETECTED)
    data: str = "random scenes rendered by sim.dataset, 320x240 px, boxes of visible parts"
    licence: str = "Apache-2.0"
    seed: int = 0


@dataclass(frozen=True)
class Budget:
    """When to stop."""

    pictures: int
    """In all, earlier calls included; the schedule is made for these."""
    minutes: float | None
    """Of this call."""


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
    """Train on the set `train`, fit to `val`, measure on `test` and `empty`, write it all down.

    Args:
        data_dir: Data sets as `services.perception.training.detector.frames` describes; the
            checkpoint is kept there too.
        out_dir: Gets `detector.onnx`, its card `detector.json`, `detector_report.json` and
            `detector_reliability.png`.
        epochs: Passes over the training pictures in all, earlier calls included.
        minutes: Ends this call early; a later one with `resume` goes on.
        resume: Continue from the checkpoint if there is one.
        progress: Show a bar on stderr.
        recipe: Classes, seed and words for the card.
        threads: Of the processor; a GPU is used if torch sees one.

    Returns:
        The card as a plain dict.

    Raises:
        MissingFramesError: the pictures are missing.
        DetectorFileError: the checkpoint is of another training.
    """
    recipe = recipe or Recipe()
    torch.set_num_threads(threads)
    sets = {name: read_frames(data_dir / name) for name in ("train", "val", "test", "empty")}
    training, checkpoint = Training(recipe.classes, recipe.seed), data_dir / "checkpoint.pt"
    if resume and checkpoint.exists():
        training.load(checkpoint)
    budget = Budget(epochs * len(sets["train"]), minutes)
    _learn(training, sets["train"], budget, checkpoint, progress)
    out_dir.mkdir(parents=True, exist_ok=True)
    card = _card(training, recipe, sets, out_dir / "detector.onnx")
    data = {
        name: data_set(data_dir / name, frames, recipe.classes) for name, frames in sets.items()
    }
    report = training_report(card, data, str(training.device), training.cpu_s, training.losses)
    write_report(report, out_dir)
    return msgspec.to_builtins(card)


def _card(
    training: Training, recipe: Recipe, sets: dict[str, list[Frame]], weights: Path
) -> DetectorCard:
    """Write weights and card, which says how good OpenCV is with them."""
    export_network(training.average.cpu(), weights)
    card = _unmeasured(training, weights, recipe, len(sets["train"]))
    return measured(card, weights, HeldOut(sets["val"], sets["test"], sets["empty"]))


def _learn(
    training: Training, frames: list[Frame], budget: Budget, checkpoint: Path, progress: bool
) -> None:
    stream = shuffled(frames, _batch, training.rng)
    began = saved = time.monotonic()
    with _bar(progress) as bar:
        task = bar.add_task(
            "training", total=budget.pictures, completed=training.pictures_seen, loss=0.0
        )
        while training.pictures_seen < budget.pictures:
            cpu_began = time.process_time()
            calm = training.pictures_seen > (1 - _calm_share) * budget.pictures
            changed = mirrored if calm else augmented
            batch = [changed(frame, training.rng) for frame in next(stream)]
            loss = training.step(batch, budget.pictures)
            training.cpu_s += time.process_time() - cpu_began
            bar.update(task, completed=training.pictures_seen, loss=loss)
            now = time.monotonic()
            if now - saved > _checkpoint_every_s:
                training.save(checkpoint)
                saved = now
            if budget.minutes is not None and now - began > 60 * budget.minutes:
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
