"""How a network writes down its boxes, recognised from the shapes of its outputs.

The same name has meant several layouts over the years, so a name decides nothing here. Shapes do,
together with the number of classes and what the network answers to a plain grey picture.

| layout | outputs | meaning of a row |
| --- | --- | --- |
| `end_to_end` | (1, K, 6) | x0 y0 x1 y1, score, class; overlaps are already removed |
| `class_scores` | (1, 4+C[+more], N) or (1, N, 4+C) | middle x y, width, height, C scores |
| `objectness` | (1, N, 5+C) | middle x y, width, height, objectness, C scores |
| `cell_offsets` | (1, N, 5+C) | the same, boxes relative to their cell in units of its stride |
| `maps` | a map (1, 5+C, H, W) for each stride | as `cell_offsets` |
| `corners_and_scores` | (1, N, 1, 4) and (1, N, C) | x0 y0 x1 y1 from 0 to 1; C scores |

N counts the cells of all strides, or three times that where each cell has three boxes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Floats
from services.perception.errors import DetectorFileError

Outputs = Sequence[NDArray[np.float32]]

stride_sets = ((8, 16, 32), (16, 32), (8, 16, 32, 64), (4, 8, 16, 32), (4, 8, 16))
"""Of the maps of usual networks [px]."""
_decoded_within = 4.0
"""Decoded boxes of a grey picture lie about their cells, at most so many strides off."""

_rounding = 1e-3
"""What a sigmoid may seem to leave its range by."""


class Layout(StrEnum):
    """What the rows and columns of the outputs are."""

    END_TO_END = "end_to_end"
    CLASS_SCORES = "class_scores"
    OBJECTNESS = "objectness"
    CELL_OFFSETS = "cell_offsets"
    MAPS = "maps"
    CORNERS_AND_SCORES = "corners_and_scores"


@dataclass(frozen=True)
class Question:
    """What is known when a layout is to be recognised."""

    width: int
    """Of the input [px]."""
    height: int
    classes: int
    more_channels: bool
    """Whether boxes may carry more than scores, as masks and joints do."""
    end_to_end: bool
    """Whether the file itself says that overlaps are already removed."""
    said: Layout | None = None
    """What a person says it is, where shapes leave a choice."""


@dataclass(frozen=True)
class Recognised:
    """A layout, and what else the answer to a grey picture told."""

    layout: Layout
    boxes_a_cell: int = 1
    logits: bool = False
    """Scores still have to go through a sigmoid."""
    transposed: bool = False
    """Boxes are columns, not rows."""

    def __str__(self) -> str:
        three = ", three boxes a cell" if self.boxes_a_cell == 3 else ""
        return f"{self.layout}{three}{', logits' if self.logits else ''}"


def recognised(outputs: Outputs, question: Question) -> Recognised:
    """Recognise the layout of the outputs that a grey picture gave.

    Raises:
        DetectorFileError: no layout fits; the text lists the shapes and what would be understood.
    """
    found = _fitting(outputs, question)
    if question.said not in (None, found.layout):
        raise DetectorFileError(
            f"it is said to be of layout {question.said}, but its outputs are {found.layout}"
        )
    return found


def _fitting(outputs: Outputs, question: Question) -> Recognised:
    tables = [output for output in outputs if output.ndim == 3]
    if len(outputs) == 2 and (found := _corners_and_scores(outputs, question)):
        return found
    if tables:
        return _table(tables[0], question)
    if outputs and all(output.ndim == 4 for output in outputs):
        return _maps(outputs, question)
    raise _unknown(outputs, question)


def _table(output: NDArray[np.float32], question: Question) -> Recognised:
    rows, columns = output.shape[1:]
    counts = _counts(question)
    end_to_end = question.end_to_end or question.said is Layout.END_TO_END
    # With one class or two, six columns may be something else; the number of rows tells.
    if columns == 6 and (end_to_end or rows not in counts or question.classes > 2):
        return Recognised(Layout.END_TO_END)
    if columns in counts and rows not in counts:
        return _boxes_as_columns(output, question)
    if rows not in counts:
        raise _unknown([output], question)
    if columns == question.classes + 4 and counts[rows] == 1:
        return Recognised(Layout.CLASS_SCORES)
    if columns != question.classes + 5:
        raise _miscounted(output, columns - 5, question)
    return _with_objectness(output[0], counts[rows], question)


def _boxes_as_columns(output: NDArray[np.float32], question: Question) -> Recognised:
    found = output.shape[1] - 4
    if found < question.classes or (found > question.classes and not question.more_channels):
        raise _miscounted(output, found, question)
    return Recognised(Layout.CLASS_SCORES, transposed=True)


def _with_objectness(rows: NDArray[np.float32], boxes_a_cell: int, ask: Question) -> Recognised:
    logits = _are_logits(rows[:, 4:])
    if boxes_a_cell > 1:
        return Recognised(Layout.OBJECTNESS, boxes_a_cell, logits)
    centers, strides = cell_grid(_strides(len(rows), ask), ask.width, ask.height)
    off = np.median(np.abs(rows[:, :2] - centers) / strides)
    measured = Layout.OBJECTNESS if off < _decoded_within else Layout.CELL_OFFSETS
    said = ask.said if ask.said in (Layout.OBJECTNESS, Layout.CELL_OFFSETS) else None
    return Recognised(said or measured, logits=logits)


def _maps(outputs: Outputs, question: Question) -> Recognised:
    channels = {int(output.shape[1]) for output in outputs}
    if len(channels) == 1 and channels <= {3 * (5 + question.classes)}:
        raise DetectorFileError(
            "its outputs are raw maps of boxes that stand relative to anchor boxes, which are not "
            "in the file: export it with the decoding inside"
        )
    if channels != {5 + question.classes}:
        raise _unknown(outputs, question)
    values = np.concatenate([output[0, 4:].reshape(-1) for output in outputs])
    return Recognised(Layout.MAPS, logits=_are_logits(values))


def _corners_and_scores(outputs: Outputs, question: Question) -> Recognised | None:
    corners, scores = outputs
    fits = corners.shape in {(1, len(scores[0]), 1, 4), (1, len(scores[0]), 4)}
    if not fits or scores.ndim != 3:
        return None
    if scores.shape[2] != question.classes:
        raise _miscounted(scores, int(scores.shape[2]), question)
    return Recognised(Layout.CORNERS_AND_SCORES)


@lru_cache(maxsize=16)
def cell_grid(strides: tuple[int, ...], width: int, height: int) -> tuple[Floats, Floats]:
    """Upper left corners (N, 2) as x, y and strides (N, 1) of all cells [px], rows first."""
    corners: list[Floats] = []
    sizes: list[Floats] = []
    for stride in strides:
        y, x = np.mgrid[: height // stride, : width // stride]
        corners.append(np.stack([x, y], -1).reshape(-1, 2) * float(stride))
        sizes.append(np.full((x.size, 1), float(stride)))
    return np.concatenate(corners), np.concatenate(sizes)


def strides_of(rows: int, width: int, height: int) -> tuple[int, ...]:
    """Strides whose cells are as many as the rows; none if no usual ones are."""
    for strides in stride_sets:
        if _cells(strides, width, height) == rows:
            return strides
    return ()


def _strides(rows: int, question: Question) -> tuple[int, ...]:
    return strides_of(rows, question.width, question.height)


def _counts(question: Question) -> dict[int, int]:
    """Boxes each for one cell or three of all usual strides, and which of the two."""
    cells = [_cells(strides, question.width, question.height) for strides in stride_sets]
    return {each * count: each for each in (3, 1) for count in cells}


def _cells(strides: Sequence[int], width: int, height: int) -> int:
    return sum((height // stride) * (width // stride) for stride in strides)


def _are_logits(values: NDArray[Any]) -> bool:
    return bool(values.size) and bool(values.min() < -_rounding or values.max() > 1 + _rounding)


def _miscounted(output: NDArray[Any], found: int, question: Question) -> DetectorFileError:
    return DetectorFileError(
        f"{question.classes} class names are given, but its output {output.shape} has room for "
        f"{max(found, 0)}"
    )


def _unknown(outputs: Outputs, question: Question) -> DetectorFileError:
    shapes = ", ".join(str(tuple(output.shape)) for output in outputs) or "none"
    return DetectorFileError(
        f"its outputs {shapes} for an input of {question.width}x{question.height} px and "
        f"{question.classes} classes are in no known layout; known are (1, 4+C, N), (1, N, 5+C), "
        "(1, K, 6), maps (1, 5+C, H, W), and (1, N, 1, 4) with (1, N, C)"
    )
