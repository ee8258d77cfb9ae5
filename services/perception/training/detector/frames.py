"""Labelled pictures read from disk.

A data set is a folder with `frames/000000.jpg ...` (RGB) and `shards/*.npz`, each shard with
`count` (objects of each of its frames) and, of all its objects, `boxes` (x0 y0 x1 y1 [px]),
`classes` (ids) and, optionally, `ignored`. The simulator writes this; anything else may.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from services.perception.training.pictures import read_picture, shards_in


@dataclass(frozen=True)
class Frame:
    """A picture and the G objects in it."""

    color: NDArray[np.uint8]
    """(H, W, 3) RGB."""
    boxes: NDArray[np.float32]
    """(G, 4) x0 y0 x1 y1 [px]."""
    classes: NDArray[np.int64]
    """(G,) class ids."""
    ignored: NDArray[np.bool_]
    """(G,) hardly to be seen: neither to be found nor wrong to be found."""


def read_frames(folder: Path) -> list[Frame]:
    """All complete shards of a data set, pictures in memory.

    Raises:
        MissingFramesError: there is no shard, or a picture is missing.
    """
    frames: list[Frame] = []
    for shard in shards_in(folder):
        for boxes, classes, ignored in _labels(shard):
            color = read_picture(folder, len(frames))
            frames.append(Frame(color, boxes, classes, ignored))
    return frames


def _labels(
    shard: Path,
) -> list[tuple[NDArray[np.float32], NDArray[np.int64], NDArray[np.bool_]]]:
    """Boxes, classes and whether they are ignored, of each frame."""
    with np.load(shard) as arrays:
        cuts = np.cumsum(arrays["count"])[:-1]
        boxes, classes = arrays["boxes"], arrays["classes"]
        ignored = arrays["ignored"] if "ignored" in arrays else np.zeros(len(classes), np.bool_)
    columns = (np.split(column, cuts) for column in (boxes, classes, ignored))
    return list(zip(*columns, strict=True))
