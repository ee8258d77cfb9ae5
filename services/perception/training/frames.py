"""Labelled pictures: read from disk, augmented, gathered into batches.

On disk a data set is a folder with `frames/000000.jpg ...` (RGB) and `shards/*.npz`, each shard
with `count` (objects of each of its frames), `boxes` (x0 y0 x1 y1 [px], all its objects) and
`classes` (ids). The simulator writes this; anything else may.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from services.perception.errors import MissingFramesError
from services.perception.picture import padding_value

least_side = 3.0
"""Boxes that augmentation cuts to a shorter side than this are no longer labelled [px]."""
_least_kept = 0.3
"""Nor are those of which less than this part is left."""


@dataclass(frozen=True)
class Frame:
    """A picture and the objects in it."""

    color: NDArray[np.uint8]
    """(H, W, 3) RGB."""
    boxes: NDArray[np.float32]
    """(G, 4) x0 y0 x1 y1 [px]."""
    classes: NDArray[np.int64]
    """(G,) class ids."""


def read_frames(folder: Path) -> list[Frame]:
    """All complete shards of a data set, pictures in memory.

    Raises:
        MissingFramesError: there is no shard, or a picture is missing.
    """
    shards = sorted((folder / "shards").glob("??????.npz"))
    if not shards:
        raise MissingFramesError(
            f"no training pictures in {folder}: expected shards/000000.npz there"
        )
    frames: list[Frame] = []
    for shard in shards:
        with np.load(shard) as arrays:
            cuts = np.cumsum(arrays["count"])[:-1]
            boxes, classes = np.split(arrays["boxes"], cuts), np.split(arrays["classes"], cuts)
        for frame_boxes, frame_classes in zip(boxes, classes, strict=True):
            color = _read_picture(folder / "frames" / f"{len(frames):06d}.jpg")
            frames.append(Frame(color, frame_boxes, frame_classes))
    return frames


def augmented(frame: Frame, rng: np.random.Generator) -> Frame:
    """The frame mirrored, moved, scaled and recoloured at random."""
    height, width = frame.color.shape[:2]
    scale = float(np.exp(rng.uniform(-0.35, 0.35)))
    mirror = -1.0 if rng.random() < 0.5 else 1.0
    shift = rng.uniform(-0.15, 0.15, 2) * (width, height)
    middle = np.array([width / 2, height / 2])
    linear = np.diag([mirror * scale, scale])
    new_from_old = np.column_stack([linear, middle + shift - linear @ middle])
    color = cv2.warpAffine(frame.color, new_from_old, (width, height), borderValue=_fill)
    boxes, kept = _moved(frame.boxes, new_from_old, width, height)
    return Frame(_recoloured(np.asarray(color, np.uint8), rng), boxes[kept], frame.classes[kept])


def batches(frames: list[Frame], size: int, rng: np.random.Generator) -> Iterator[list[Frame]]:
    """Augmented frames in random order without end, each once before any comes again."""
    waiting: list[int] = []
    while True:
        while len(waiting) < size:
            waiting += rng.permutation(len(frames)).tolist()
        chosen, waiting = waiting[:size], waiting[size:]
        yield [augmented(frames[index], rng) for index in chosen]


_fill = (padding_value, padding_value, padding_value)


def _read_picture(path: Path) -> NDArray[np.uint8]:
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR_RGB)
    if picture is None:
        raise MissingFramesError(f"cannot read the training picture {path}")
    return np.asarray(picture, np.uint8)


def _moved(
    boxes: NDArray[np.float32], new_from_old: NDArray[np.float64], width: int, height: int
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Boxes after the move, cut at the picture's edge, and which of them still count."""
    ends = boxes.reshape(-1, 2, 2) @ new_from_old[:, :2].T + new_from_old[:, 2]
    whole = np.concatenate([ends.min(1), ends.max(1)], 1)
    cut = np.clip(whole, 0, [width, height, width, height])
    sides, whole_sides = cut[:, 2:] - cut[:, :2], whole[:, 2:] - whole[:, :2]
    kept = (sides.min(1) >= least_side) & (sides.prod(1) >= _least_kept * whole_sides.prod(1))
    return cut.astype(np.float32), kept


def _recoloured(color: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Brightness, contrast, tint, and now and then the noise and blur of a real camera."""
    gain = rng.uniform(0.7, 1.35) * rng.uniform(0.92, 1.08, 3)
    offset = rng.uniform(-18, 18)
    table = np.clip(np.arange(256)[:, None] * gain + offset, 0, 255).astype(np.uint8)
    color = np.asarray(cv2.LUT(color, table[:, None].reshape(256, 1, 3)), np.uint8)
    if rng.random() < 0.15:
        color = np.asarray(cv2.blur(color, (3, 3)), np.uint8)
    if rng.random() < 0.3:
        noise = rng.normal(0, rng.uniform(2, 8), color.shape)
        color = np.clip(color + noise, 0, 255).astype(np.uint8)
    return color
