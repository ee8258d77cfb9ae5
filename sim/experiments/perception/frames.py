"""Pictures with depth and the truth in space, rendered once and kept in a folder.

    runs/perception-frames/
      test-0/                  set and seed
        frames/000000.jpg ...  320 x 240 RGB, six of each scene
        truth/000000.npz ...   of each scene: depth as the sensor gives it, camera poses, and of
                               all objects boxes, classes, centres and sizes
      empty-0/                 likewise, distractors alone

They are the frames of `sim.dataset` of the same set and seed.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Flags, Floats
from schemas.geometry import Pose2, Pose3
from schemas.sensing import Intrinsics, RgbdFrame
from sim.assets.library import DETECTED
from sim.experiments.perception.scene_files import Scene, write_scene
from sim.scenes.training_views import FRAMES_PER_SCENE
from sim.shards import worked
from sim.vulkan import activate, device_name

FOLDER = Path("runs/perception-frames")


@dataclass(frozen=True)
class KnownFrame:
    """A frame as a robot gets it, and the N objects that are truly in it."""

    scene: int
    frame: RgbdFrame
    boxes: Floats
    """(N, 4) x0 y0 x1 y1 [px] around visible pixels."""
    labels: tuple[str, ...]
    """N names of `DETECTED`."""
    ignored: Flags
    """(N,) too small or too much hidden to be asked for."""
    centers: Floats
    """(N, 3) middles of their boxes, base frame [m]."""
    sizes: Floats
    """(N, 3) of those boxes, along their own axes [m]."""


class FrameSet(Sequence[KnownFrame]):
    """The first frames of a set, read from disk when asked for."""

    def __init__(self, folder: Path, part: str, seed: int, count: int) -> None:
        home, scenes = folder / f"{part}-{seed}", math.ceil(count / FRAMES_PER_SCENE)
        self.part = part
        self._scenes = [Scene(home, part, seed, number) for number in range(scenes)]
        self._count = count

    @property
    def scenes(self) -> int:
        """How many scenes the frames are of."""
        return len(self._scenes)

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> KnownFrame:  # pyright: ignore[reportIncompatibleMethodOverride]
        if not 0 <= index < self._count:
            raise IndexError(f"frame {index}; there are {self._count}")
        return _read(self._scenes[index // FRAMES_PER_SCENE])[index % FRAMES_PER_SCENE]

    def __iter__(self) -> Iterator[KnownFrame]:
        for scene in self._scenes:
            yield from _read(scene)[: self._count - FRAMES_PER_SCENE * scene.number]

    def render(self, workers: int, progress: Callable[[int], None]) -> None:
        """Write the scenes that are not there yet; `progress` is told how many are done.

        Raises:
            NoVulkanDeviceError: some are missing, and there is no device to draw with.
        """
        missing = [scene for scene in self._scenes if not scene.is_complete()]
        done = self.scenes - len(missing)
        progress(done)
        if missing:
            activate()
            device_name()
        for number, _ in enumerate(worked(missing, write_scene, workers), start=done + 1):
            progress(number)


def _read(scene: Scene) -> list[KnownFrame]:
    arrays = scene.arrays()
    cuts = np.cumsum(arrays["count"])[:-1]
    names = ("boxes", "classes", "ignored", "centers", "sizes")
    columns = {name: np.split(arrays[name], cuts) for name in names}
    return [
        KnownFrame(
            scene=scene.number,
            frame=_frame(scene, view, arrays),
            boxes=columns["boxes"][view].astype(np.float64),
            labels=tuple(DETECTED[index] for index in columns["classes"][view].tolist()),
            ignored=columns["ignored"][view],
            centers=columns["centers"][view],
            sizes=columns["sizes"][view],
        )
        for view in range(len(arrays["count"]))
    ]


def _frame(scene: Scene, view: int, arrays: dict[str, NDArray[Any]]) -> RgbdFrame:
    width, height, *lengths = arrays["intrinsics"][view].tolist()
    x, y, z, *wxyz = arrays["mounts"][view].tolist()
    return RgbdFrame(
        stamp_ns=0,
        color=scene.color(view),
        depth_mm=arrays["depth"][view],
        intrinsics=Intrinsics(int(width), int(height), *lengths),
        base_from_camera=Pose3((x, y, z), (wxyz[0], wxyz[1], wxyz[2], wxyz[3])),
        odom_from_base=Pose2(0.0, 0.0, 0.0),
    )
