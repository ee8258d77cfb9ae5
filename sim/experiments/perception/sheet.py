"""Pictures with what was found in them, side by side."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from schemas.errors import UserError
from services.perception.detection.boxes import Boxes
from services.perception.drawing import draw_boxes, write_png

COLUMNS = 4
CELL = 400, 300
"""Width and height of one picture on the sheet [px]; what has other proportions is on grey."""
_grey = 114


@dataclass(frozen=True)
class Drawn:
    """A picture and the boxes to draw in it."""

    color: NDArray[np.uint8]
    """(H, W, 3) RGB."""
    boxes: Boxes
    classes: tuple[str, ...]


def draw_sheet(pictures: Sequence[Drawn], path: Path) -> None:
    """Write a sheet of pictures.

    Raises:
        UserError: the file cannot be written.
    """
    columns = min(COLUMNS, len(pictures))
    rows = math.ceil(len(pictures) / columns)
    sheet = np.full((rows * CELL[1], columns * CELL[0], 3), _grey, np.uint8)
    for number, one in enumerate(pictures):
        row, column = divmod(number, columns)
        y, x = row * CELL[1], column * CELL[0]
        sheet[y : y + CELL[1], x : x + CELL[0]] = _cell(one)
    if not write_png(str(path), sheet):
        raise UserError(f"cannot write {path}")


def _cell(one: Drawn) -> NDArray[np.uint8]:
    """The picture with its boxes, as large as a cell; text is drawn last, to stay sharp."""
    height, width = one.color.shape[:2]
    scale = min(CELL[0] / width, CELL[1] / height)
    size = (max(round(width * scale), 1), max(round(height * scale), 1))
    method = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    picture = np.array(cv2.resize(one.color, size, interpolation=method), np.uint8)
    names = [one.classes[index] for index in one.boxes.classes.tolist()]
    best = one.boxes.probabilities.max(axis=1, initial=0.0)
    labels = [f"{name} {value:.2f}" for name, value in zip(names, best, strict=True)]
    draw_boxes(picture, scale * one.boxes.corners_px, labels)
    cell = np.full((CELL[1], CELL[0], 3), _grey, np.uint8)
    cell[: size[1], : size[0]] = picture
    return cell
