"""Draws what was found into a picture, for people to look at."""

import cv2
import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Floats

_ink, _ground = (255, 230, 60), (0, 0, 0)
_font, _size = cv2.FONT_HERSHEY_SIMPLEX, 0.4


def draw_boxes(picture: NDArray[np.uint8], boxes: Floats, names: list[str]) -> None:
    """Boxes (N, 4) x0 y0 x1 y1 [px] with a name each, into an RGB picture in place."""
    for (x0, y0, x1, y1), name in zip(np.round(boxes).astype(int).tolist(), names, strict=True):
        cv2.rectangle(picture, (x0, y0), (x1, y1), _ink, 1)
        draw_line(picture, name, (x0 + 2, max(y0 - 3, 10)))


def draw_outlines(picture: NDArray[np.uint8], corners: Floats, names: list[str]) -> None:
    """Outlines (N, 4, 2) [px] of tags with a name each, into an RGB picture in place."""
    for outline, name in zip(np.round(corners).astype(np.int32), names, strict=True):
        cv2.polylines(picture, [outline], True, _ink, 1)
        draw_line(picture, name, (int(outline[:, 0].min()), int(outline[:, 1].max()) + 12))


def draw_line(picture: NDArray[np.uint8], text: str, at: tuple[int, int]) -> None:
    """A line of text whose lower left corner is at x, y [px]; readable on any ground."""
    cv2.putText(picture, text, at, _font, _size, _ground, 3)
    cv2.putText(picture, text, at, _font, _size, _ink, 1)


def write_png(path: str, picture: NDArray[np.uint8]) -> bool:
    """Write an RGB picture; False if that is not possible."""
    return bool(cv2.imwrite(path, cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)))
