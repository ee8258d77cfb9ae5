"""How one picture is looked at: which parts of it, and by which networks."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from schemas.arrays import Flags, Floats, Ints
from services.perception.detection.picture import Fit

_step = 32
"""Sides of a part are multiples of this: the coarsest stride of the networks [px]."""
_grain = 8
"""Parts begin at multiples of this, the finest stride: their cells are those of the whole [px]."""
_overhead = 2000
"""What one more pass of a network costs beside its pixels [px]."""

_rim = 2
"""Boxes that end nearer than this to an edge are cut by it [px]."""

Part = tuple[slice, slice]
"""Rows and columns."""


@dataclass(frozen=True)
class Gaze:
    """The choice for one picture."""

    regions: Ints | None = None
    """(R, 4) x0 y0 x1 y1 of parts of the picture [px]; None is all of it."""
    networks: frozenset[int] | None = None
    """Numbers of the networks of several that are run; None is all of them."""

    def runs(self, number: int) -> bool:
        """Whether a network is run."""
        return self.networks is None or number in self.networks

    def parts(self, fit: Fit, width: int, height: int) -> list[Part]:
        """The parts of a network's input of `width` x `height` px, which are multiples of 32.

        No two of them overlap: at an edge a network would find a second time half of what it finds
        whole in another part.

        Args:
            fit: where the picture lies in the input.
            width: of the input [px].
            height: of the input [px].
        """
        whole = np.array([0, 0, width, height])
        if self.regions is None:
            return [_part(whole)]
        moved = self.regions * [*fit.scale, *fit.scale] + [*fit.offset, *fit.offset]
        boxes = _merged([_widened(box, whole) for box in moved], whole)
        dear = sum(map(_cost, boxes)) >= _cost(whole)
        return [_part(box) for box in ([whole] if dear else boxes)]


EVERYTHING = Gaze()
"""All of the picture, by all networks."""


def cut_off(corners: Floats, part: Part, width: int, height: int) -> Flags:
    """(N,) Which boxes (N, 4) in an input of `width` x `height` px end where a part of it does.

    What is looked at has room around it: they are on something else, of which the part shows half.
    """
    rows, columns = part
    low = np.array([columns.start, rows.start])
    high = np.array([columns.stop, rows.stop])
    inner_low, inner_high = low > 0, high < [width, height]
    before = (corners[:, :2] < low + _rim) & inner_low
    after = (corners[:, 2:] > high - _rim) & inner_high
    return np.asarray((before | after).any(axis=1), np.bool_)


def _merged(boxes: list[Ints], whole: Ints) -> list[Ints]:
    """Boxes that cover the same, where two of them overlap or are dearer than one around both."""
    for one, other in combinations(range(len(boxes)), 2):
        low, high = boxes[one], boxes[other]
        around = np.concatenate([np.minimum(low[:2], high[:2]), np.maximum(low[2:], high[2:])])
        joined = _widened(around, whole)
        if _overlap(low, high) or _cost(joined) <= _cost(low) + _cost(high):
            rest = [box for row, box in enumerate(boxes) if row not in (one, other)]
            return _merged([*rest, joined], whole)
    return boxes


def _widened(box: Ints, whole: Ints) -> Ints:
    """A box of whole steps around one (4,), within the input."""
    start = np.floor_divide(box[:2], _grain).astype(np.int64) * _grain
    sides = np.minimum(-np.floor_divide(start - box[2:], _step).astype(np.int64) * _step, whole[2:])
    start = np.minimum(start, whole[2:] - sides)
    return np.concatenate([start, start + sides]).astype(np.int32)


def _overlap(one: Ints, other: Ints) -> bool:
    return bool((np.maximum(one[:2], other[:2]) < np.minimum(one[2:], other[2:])).all())


def _cost(box: Ints) -> int:
    width, height = (box[2:] - box[:2]).tolist()
    return width * height + _overhead


def _part(box: Ints) -> Part:
    x0, y0, x1, y1 = box.tolist()
    return slice(y0, y1), slice(x0, x1)
