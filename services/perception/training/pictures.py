"""Rendered training pictures as they lie in a folder: numbered pictures, and shards of labels."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from services.perception.errors import MissingFramesError


def shards_in(folder: Path) -> list[Path]:
    """Files of labels, in order.

    Raises:
        MissingFramesError: there is none.
    """
    shards = sorted((folder / "shards").glob("??????.npz"))
    if not shards:
        raise MissingFramesError(
            f"no training pictures in {folder}: expected shards/000000.npz there"
        )
    return shards


def read_picture(folder: Path, number: int) -> NDArray[np.uint8]:
    """One RGB picture (H, W, 3).

    Raises:
        MissingFramesError: it is missing or cannot be read.
    """
    path = folder / "frames" / f"{number:06d}.jpg"
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR_RGB)
    if picture is None:
        raise MissingFramesError(f"cannot read the training picture {path}")
    return np.asarray(picture, np.uint8)
