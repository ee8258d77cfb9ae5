"""Shards of a set of pictures: rendered by one process or several, each complete or not there."""

from __future__ import annotations

import math
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from PIL import Image

from sim.annotation import TrainingFrame
from sim.scenes.training_parts import get_part
from sim.scenes.training_views import FRAMES_PER_SCENE
from sim.vulkan import activate

if TYPE_CHECKING:
    from sim.frames import FrameRenderer

Job = TypeVar("Job")
RECIPE = 1
"""Counted up when scenes, looks or labels change: shards of another recipe are rendered anew."""


@dataclass(frozen=True)
class Shard:
    """Frames of a set that are rendered and written together."""

    folder: Path
    part: str
    seed: int
    start: int
    """Number of the first frame, a multiple of `FRAMES_PER_SHARD`."""
    size: int

    @property
    def path(self) -> Path:
        """The file of its labels."""
        return self.folder / "shards" / f"{self.start:06d}.npz"

    def is_complete(self) -> bool:
        """Whether it has been written as it would be written now."""
        if not self.path.exists() or _made_from(self.path) != (self.part, self.seed, RECIPE):
            return False
        with np.load(self.path) as arrays:
            return len(arrays["count"]) == self.size


def _made_from(path: Path) -> tuple[str, int, int] | None:
    """Set, seed and recipe of a shard; None if it does not say."""
    with np.load(path) as arrays:
        if "recipe" not in arrays:
            return None
        return str(arrays["part"]), int(arrays["seed"]), int(arrays["recipe"])


def remove_stale(folder: Path, part: str, seed: int) -> None:
    """Remove the labels of another set, seed or recipe: whoever reads the folder reads them too."""
    for path in (folder / "shards").glob("??????.npz"):
        if _made_from(path) != (part, seed, RECIPE):
            path.unlink()


def written(shards: Sequence[Shard], workers: int) -> Iterator[Shard]:
    """The shards as they get done."""
    return worked(shards, _write, workers)


def worked(jobs: Sequence[Job], work: Callable[[Job], None], workers: int) -> Iterator[Job]:
    """Jobs that render, as they get done."""
    if workers <= 1:
        for job in jobs:
            work(job)
            yield job
        return
    # A forked process would share the driver's state with its parent.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, initializer=activate) as pool:
        running = {pool.submit(work, job): job for job in jobs}
        for future in as_completed(running):
            future.result()
            yield running[future]


def _write(shard: Shard) -> None:
    """Pictures first: the labels say that the shard is complete."""
    frames = _rendered(shard)
    for index, frame in enumerate(frames, shard.start):
        name = shard.folder / "frames" / f"{index:06d}.jpg"
        Image.fromarray(frame.color).save(name, quality=95, subsampling=0)
    partial = shard.path.with_suffix(".partial.npz")
    np.savez(
        partial,
        part=shard.part,
        seed=shard.seed,
        recipe=RECIPE,
        count=np.array([len(frame.classes) for frame in frames]),
        boxes=np.concatenate([frame.boxes for frame in frames]),
        classes=np.concatenate([frame.classes for frame in frames]),
        ignored=np.concatenate([frame.ignored for frame in frames]),
        visible=np.concatenate([frame.visible for frame in frames]),
    )
    partial.rename(shard.path)


def _rendered(shard: Shard) -> list[TrainingFrame]:
    first = shard.start // FRAMES_PER_SCENE
    scenes = range(first, first + math.ceil(shard.size / FRAMES_PER_SCENE))
    part = get_part(shard.part)
    frames = [frame for scene in scenes for frame in renderer().frames(part, shard.seed, scene)]
    return frames[: shard.size]


@lru_cache(maxsize=1)
def renderer() -> FrameRenderer:
    """The renderer of this process."""
    # sapien, and with it the driver, is needed by those alone who render.
    from sim.frames import FrameRenderer  # noqa: PLC0415

    return FrameRenderer()
