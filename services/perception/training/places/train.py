"""From rendered rooms to the weights and card that the classifier of places loads."""

import time
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import torch
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from services.perception.places.card import PlacesCard
from services.perception.training.places.frames import read_places
from services.perception.training.places.loop import PlacesTraining, batches, even_odds, windows_in
from services.perception.training.places.measurement import measured_places
from services.perception.training.places.network import export_places
from services.perception.weight_files import file_sha256
from sim.scenes.rooms import ROOM_KINDS

_batch = 32
_checkpoint_every_s = 60.0
_data = "random furnished rooms rendered by sim.rendering.rooms, windows of 160x120 px, some seen "
_data += "through doorways"


def train_places(
    data_dir: Path,
    out_dir: Path,
    epochs: int,
    minutes: float | None = None,
    seed: int = 0,
    threads: int = 1,
    visible: bool = True,
) -> dict[str, Any]:
    """Train on `data_dir/train`, measure on `data_dir/val`, write weights and card to `out_dir`.

    Args:
        data_dir: two data sets as `services.perception.training.places.frames` describes; the
            checkpoint is kept there too, and a later call goes on from it.
        out_dir: gets `places.onnx` and `places.json`.
        epochs: passes over the training windows in all, earlier calls included.
        minutes: ends this call early.
        seed: of every random choice.
        threads: of the processor.
        visible: show a bar on stderr.

    Returns:
        The card as a plain dict.

    Raises:
        MissingFramesError: the pictures are missing.
    """
    torch.set_num_threads(threads)
    pictures, held_out = read_places(data_dir / "train"), read_places(data_dir / "val")
    windows = windows_in(pictures)
    odds = np.array([even_odds(column, len(ROOM_KINDS)) for column in windows.labels.T])
    training, checkpoint = PlacesTraining(len(ROOM_KINDS), seed, odds), data_dir / "checkpoint.pt"
    if checkpoint.exists():
        training.load(checkpoint)
    total, began = epochs * len(windows.labels), time.monotonic()
    saved, stream = began, batches(windows, _batch, training.rng)
    with _bar(visible) as bar:
        task = bar.add_task("training", total=total, loss=0.0)
        while training.windows_seen < total:
            loss = training.step(next(stream), total)
            bar.update(task, completed=training.windows_seen, loss=loss)
            now = time.monotonic()
            if now - saved > _checkpoint_every_s:
                training.save(checkpoint)
                saved = now
            if minutes is not None and now - began > 60 * minutes:
                break
    training.save(checkpoint)
    out_dir.mkdir(parents=True, exist_ok=True)
    weights = out_dir / "places.onnx"
    export_places(training.network, weights)
    card = measured_places(_unmeasured(training, weights, len(pictures), seed), weights, held_out)
    return msgspec.to_builtins(card)


def _unmeasured(training: PlacesTraining, weights: Path, pictures: int, seed: int) -> PlacesCard:
    """The card without figures: what is measured is the classifier that will run."""
    return PlacesCard(
        types=ROOM_KINDS,
        sha256=file_sha256(weights),
        licence="Apache-2.0",
        data=_data,
        training_pictures=pictures,
        validation_pictures=0,
        seed=seed,
        windows_seen=training.windows_seen,
        parameters=sum(parameter.numel() for parameter in training.network.parameters()),
    )


def _bar(visible: bool) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("windows, loss {task.fields[loss]:.2f},"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        disable=not visible,
    )
