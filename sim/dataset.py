"""Training pictures for the object detector, rendered from random scenes.

In memory, for ever, the same for the same seed:

    for frame in render_frames(seed=0):      # about 20 frames/s on one core
        frame.color, frame.boxes, frame.classes

On disk, resumable after an interruption, and back:

    write_dataset(Path("train"), count=3000, seed=0, progress=lambda done, count: None)
    frames = Dataset(Path("train"))          # len(frames), frames[i] is a TrainingFrame
    contact_sheet(frames).save("sheet.png")

`python -m sim.dataset --help` does the same. Class ids index `sim.assets.library.DETECTED`.
Use another seed for validation. A Vulkan driver must be active (`sim.vulkan`).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Sequence
from itertools import count as count_from
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from sim.annotation import TrainingFrame
from sim.assets.library import DETECTED
from sim.vulkan import activate

FRAMES_PER_SHARD = 60


def render_frames(seed: int, first_scene: int = 0) -> Iterator[TrainingFrame]:
    """Training frames without end, six of each random scene."""
    # sapien, and with it the driver, is needed by those alone who render.
    from sim.frames import FrameRenderer  # noqa: PLC0415

    renderer = FrameRenderer()
    for scene in count_from(first_scene):
        yield from renderer.frames(seed, scene)


def write_dataset(
    path: Path,
    count: int,
    seed: int,
    resume: bool = True,
    progress: Callable[[int, int], None] = lambda done, count: None,
) -> None:
    """Write `count` frames as `frames/000000.jpg` and labels in `shards/000000.npz`.

    A shard is written when its pictures are complete; with `resume` the shards already there are
    kept if they are of the same seed. `progress` is called after every shard with the frames done
    and `count`.
    """
    from sim.frames import FRAMES_PER_SCENE, FrameRenderer  # noqa: PLC0415

    (path / "frames").mkdir(parents=True, exist_ok=True)
    (path / "shards").mkdir(exist_ok=True)
    renderer: FrameRenderer | None = None
    for start in range(0, count, FRAMES_PER_SHARD):
        size = min(FRAMES_PER_SHARD, count - start)
        shard = path / "shards" / f"{start:06d}.npz"
        if not (resume and _is_complete(shard, size, seed)):
            renderer = renderer or FrameRenderer()
            first = start // FRAMES_PER_SCENE
            scenes = range(first, first + math.ceil(size / FRAMES_PER_SCENE))
            frames = [frame for scene in scenes for frame in renderer.frames(seed, scene)]
            _write_shard(path, shard, start, seed, frames[:size])
        progress(start + size, count)


def _is_complete(shard: Path, size: int, seed: int) -> bool:
    if not shard.exists():
        return False
    with np.load(shard) as arrays:
        return len(arrays["count"]) == size and int(arrays["seed"]) == seed


def _write_shard(
    path: Path, shard: Path, start: int, seed: int, frames: Sequence[TrainingFrame]
) -> None:
    for index, frame in enumerate(frames, start):
        name = path / "frames" / f"{index:06d}.jpg"
        Image.fromarray(frame.color).save(name, quality=95, subsampling=0)
    partial = shard.with_suffix(".partial.npz")
    np.savez(
        partial,
        seed=seed,
        count=np.array([len(frame.classes) for frame in frames]),
        boxes=np.concatenate([frame.boxes for frame in frames]),
        classes=np.concatenate([frame.classes for frame in frames]),
    )
    partial.rename(shard)


class Dataset(Sequence[TrainingFrame]):
    """Frames that `write_dataset` has written so far, read from disk when asked for."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._boxes: list[NDArray[np.float32]] = []
        self._classes: list[NDArray[np.int64]] = []
        for shard in sorted((path / "shards").glob("??????.npz")):
            with np.load(shard) as arrays:
                cuts = np.cumsum(arrays["count"])[:-1]
                self._boxes += np.split(arrays["boxes"], cuts)
                self._classes += np.split(arrays["classes"], cuts)

    def __len__(self) -> int:
        return len(self._boxes)

    def __getitem__(self, index: int) -> TrainingFrame:  # pyright: ignore[reportIncompatibleMethodOverride]
        boxes, classes = self._boxes[index], self._classes[index]
        name = self._path / "frames" / f"{index % len(self):06d}.jpg"
        return TrainingFrame(np.asarray(Image.open(name)), boxes, classes)


def contact_sheet(frames: Sequence[TrainingFrame], columns: int = 5, rows: int = 5) -> Image.Image:
    """The first frames side by side with their boxes drawn in."""
    chosen = list(islice(frames, columns * rows))
    height, width = chosen[0].color.shape[:2]
    sheet = Image.new("RGB", (columns * width, rows * height))
    for index, frame in enumerate(chosen):
        at = (index % columns * width, index // columns * height)
        sheet.paste(_annotated(frame), at)
    return sheet


def _annotated(frame: TrainingFrame) -> Image.Image:
    image = Image.fromarray(frame.color)
    draw = ImageDraw.Draw(image)
    for box, label in zip(frame.boxes.tolist(), frame.classes.tolist(), strict=True):
        draw.rectangle((box[0], box[1], box[2] - 1, box[3] - 1), outline=(255, 255, 0))
        draw.text((box[0] + 2, box[1] + 1), DETECTED[label], fill=(255, 255, 0))
    return image


def main() -> None:
    """Write a dataset and its contact sheet from the command line."""
    parser = argparse.ArgumentParser(description="Render training pictures for the detector.")
    parser.add_argument("path", type=Path)
    parser.add_argument("--count", type=int, default=3000)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    activate()
    write_dataset(
        arguments.path, arguments.count, arguments.seed,
        progress=lambda done, count: print(f"\r{done}/{count}", end="", flush=True),
    )  # fmt: skip
    contact_sheet(Dataset(arguments.path)).save(arguments.path / "sheet.png")


if __name__ == "__main__":
    main()
