"""Pictures for the object detector, rendered from random scenes, in four sets.

    python -m sim.dataset runs/detector-data --workers 2

renders all that training and judging need, and after an interruption goes on where it was;
`incognita train detector` does the same first. The sets are `train`, `val`, `test` and `empty`
(distractors alone); no look, scene or light of one is in another (`sim.scenes.training_parts`).

    runs/detector-data/
      train/
        frames/000000.jpg ...   320 x 240 RGB
        shards/000000.npz ...   labels of 60 frames each:
          count    (60,) int            objects of each frame; the arrays below hold all N of them
          boxes    (N, 4) float32       x0 y0 x1 y1 [px] around visible pixels
          classes  (N,) int64           index into `sim.assets.library.DETECTED`
          ignored  (N,) bool            too small or too much hidden to be asked for: neither
                                        training nor evaluation minds whether it is found
          visible  (N,) float32         share of the object that shows
          part, seed, recipe            what the shard was made from
        sheet.png               25 of the frames with their boxes
      val/ test/ empty/         likewise

In memory, for ever, the same for the same seed:

    for frame in render_frames("train", seed=0):
        frame.color, frame.boxes, frame.classes, frame.ignored

With depth, camera pose and oriented boxes in space, for judging 3-D detection:

    for truth in FrameRenderer().true_frames(get_part("test"), seed=0, scene=0):
        truth.frame, truth.depth, truth.centers, truth.rotations, truth.sizes

A Vulkan driver must be active (`sim.vulkan`).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import count as count_from
from pathlib import Path

import numpy as np
from PIL import Image
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from sim.annotation import TrainingFrame
from sim.contact_sheet import contact_sheet
from sim.scenes.training_parts import get_part
from sim.shards import Shard, remove_stale, renderer, written
from sim.vulkan import activate

COUNTS: dict[str, int] = {"train": 12_000, "val": 600, "test": 1_000, "empty": 500}
"""Pictures of each set."""
FRAMES_PER_SHARD = 60
Progressed = Callable[[str, int, int], None]
"""Told the set, its frames that are there, and how many it will have."""


def render_frames(part: str, seed: int, first_scene: int = 0) -> Iterator[TrainingFrame]:
    """Frames of a set without end, six of each random scene."""
    for scene in count_from(first_scene):
        yield from renderer().frames(get_part(part), seed, scene)


def write_sets(
    folder: Path,
    counts: Mapping[str, int] = COUNTS,
    seed: int = 0,
    workers: int = 1,
    progress: Progressed = lambda part, done, count: None,
) -> None:
    """Write several sets, each in a folder of its name with a contact sheet."""
    for part, count in counts.items():
        write_dataset(folder / part, part, count, seed, workers, progress)
        contact_sheet(Dataset(folder / part)).save(folder / part / "sheet.png")


def write_dataset(
    path: Path,
    part: str,
    count: int,
    seed: int = 0,
    workers: int = 1,
    progress: Progressed = lambda part, done, count: None,
) -> None:
    """Write `count` frames of a set, those of complete shards excepted.

    Labels that were made otherwise are removed. With more than one worker, shards are rendered by
    processes of their own. `progress` is called at once and after every shard.
    """
    (path / "frames").mkdir(parents=True, exist_ok=True)
    (path / "shards").mkdir(exist_ok=True)
    remove_stale(path, part, seed)
    starts = range(0, count, FRAMES_PER_SHARD)
    shards = [Shard(path, part, seed, at, min(FRAMES_PER_SHARD, count - at)) for at in starts]
    missing = [shard for shard in shards if not shard.is_complete()]
    done = count - sum(shard.size for shard in missing)
    progress(part, done, count)
    for shard in written(missing, workers):
        done += shard.size
        progress(part, done, count)


class Dataset(Sequence[TrainingFrame]):
    """Frames that `write_dataset` has written so far, read from disk when asked for."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._rows: list[tuple[int, dict[str, np.ndarray]]] = []
        for shard in sorted((path / "shards").glob("??????.npz")):
            with np.load(shard) as arrays:
                cuts = np.cumsum(arrays["count"])[:-1]
                names = ("boxes", "classes", "ignored", "visible")
                columns = {name: np.split(arrays[name], cuts) for name in names}
                for row in range(len(arrays["count"])):
                    one = {name: column[row] for name, column in columns.items()}
                    self._rows.append((int(shard.stem) + row, one))

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index: int) -> TrainingFrame:  # pyright: ignore[reportIncompatibleMethodOverride]
        number, columns = self._rows[index]
        picture = Image.open(self._path / "frames" / f"{number:06d}.jpg")
        return TrainingFrame(np.asarray(picture), **columns)


def progress_bar() -> Progress:
    """One line for each set."""
    return Progress(
        TextColumn("rendering {task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
    )


def write_sets_visibly(folder: Path, counts: Mapping[str, int], seed: int, workers: int) -> None:
    """As `write_sets`, with progress bars on stderr."""
    activate()
    with progress_bar() as bar:
        tasks = {part: bar.add_task(part, total=count) for part, count in counts.items()}
        write_sets(folder, counts, seed, workers,
                   lambda part, done, count: bar.update(tasks[part], completed=done))  # fmt: skip


def main() -> None:
    """Write the sets from the command line."""
    parser = argparse.ArgumentParser(description="Render the detector's pictures.")
    parser.add_argument("folder", type=Path)
    for part, count in COUNTS.items():
        parser.add_argument(f"--{part}", type=int, default=count, help=f"pictures, {count}")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1, help="processes that render")
    arguments = vars(parser.parse_args())
    counts = {part: arguments[part] for part in COUNTS if arguments[part] > 0}
    write_sets_visibly(arguments["folder"], counts, arguments["seed"], arguments["workers"])


if __name__ == "__main__":
    main()
