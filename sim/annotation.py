"""A training picture and the boxes that belong to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SMALLEST_SIDES = (4, 8)
"""Boxes whose shorter and longer side are less than this many pixels are not labelled."""
LEAST_VISIBLE = 0.15
"""Nor are objects that show less than this part of their unoccluded box inside the picture."""


@dataclass(frozen=True)
class TrainingFrame:
    """A picture and what a detector should find in it."""

    color: NDArray[np.uint8]
    """(H, W, 3) RGB."""
    boxes: NDArray[np.float32]
    """(N, 4) x1, y1, x2, y2 [px] around visible pixels, right and lower edges exclusive."""
    classes: NDArray[np.int64]
    """(N,) indices into `DETECTED`."""


def visible_box(mask: NDArray[np.bool_], whole: float) -> NDArray[np.float32] | None:
    """Box (4,) around the true pixels, or None if too small or too much of `whole` is hidden."""
    columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
    if len(columns) == 0:
        return None
    box = np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], np.float32)
    short, long = sorted((float(box[2] - box[0]), float(box[3] - box[1])))
    if short < SMALLEST_SIDES[0] or long < SMALLEST_SIDES[1]:
        return None
    return box if np.count_nonzero(mask) >= LEAST_VISIBLE * whole else None
