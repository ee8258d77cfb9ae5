"""Evenly spread hypotheses: a hundred that cover what is believed like several hundred.

Independent samples lump together by chance, and lump elsewhere at every redraw; a robot that
follows the lumps zigzags. Quasi-random points (Sobol, scrambled by Owen's method) are even in
every projection and stay unbiased; the same ones are used as long as an utterance stands, so that
hypotheses that are drawn anew stand where they stood. Weights become copies in the order of a
Hilbert curve through the plane (Gerber and Chopin, 2015), which keeps them even.
"""

import numpy as np
from scipy.stats import qmc

from schemas.arrays import Floats, Ints

dimensions = 6
_inside = 1e-9
"""Points keep this far from the faces of the cube, where inverse distributions are infinite."""
_bits = 10
_cell = 0.1
"""Side of the curve's smallest squares [m]."""
_golden = (np.sqrt(5) - 1) / 2
_least_weight = 1e-300


class EvenPoints:
    """One sequence of points in the unit cube.

    Args:
        rng: scrambles it; one number is drawn from it.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._seed = int(rng.integers(2**32))
        self._points = np.zeros((0, dimensions))
        self.start: float = self._generator().random()
        """In [0, 1): for `even_thresholds`."""

    def first(self, count: int) -> Floats:
        """The first points (count, dimensions), always the same ones."""
        if count > len(self._points):
            # Scrambled alike, a longer sequence begins with the shorter one.
            sobol = qmc.Sobol(dimensions, scramble=True, rng=self._generator())
            points = sobol.random_base2(int(np.ceil(np.log2(count))))
            self._points = np.clip(points, _inside, 1 - _inside)
        return self._points[:count]

    def _generator(self) -> np.random.Generator:
        return np.random.default_rng(self._seed)


def along_curve(points: Floats) -> Ints:
    """Places of points (n, 2) along a Hilbert curve: near on it is near in the plane."""
    side = 1 << _bits
    cells = np.clip(np.floor(points / _cell) + side // 2, 0, side - 1).astype(np.int64)
    x, y = cells.T
    place = np.zeros(len(points), np.int64)
    for bit in range(_bits - 1, -1, -1):
        right, up = (x >> bit) & 1, (y >> bit) & 1
        place += ((3 * right) ^ up) << (2 * bit)
        # In the two lower quarters the curve is turned over, in the right one mirrored too.
        flip = (up == 0) & (right == 1)
        x, y = np.where(flip, side - 1 - x, x), np.where(flip, side - 1 - y, y)
        x, y = np.where(up == 0, y, x), np.where(up == 0, x, y)
    return place.astype(np.int32)


def even_thresholds(groups: Ints, start: float) -> Floats:
    """Numbers (n,) in [0, 1) that are even over every stretch of rows of one group.

    They are multiples of the golden ratio from `start` on, begun anew with each group, so that
    what is added to one group leaves the others as they are.

    Args:
        groups: (n, k) sorted; rows that are alike are one group.
        start: in [0, 1).
    """
    row = np.arange(len(groups))
    begins = np.ones(len(groups), np.bool_)
    begins[1:] = np.any(groups[1:] != groups[:-1], axis=1)
    rank = row - np.maximum.accumulate(np.where(begins, row, 0))
    return (start + _golden * rank) % 1.0


def copies(weights: Floats, thresholds: Floats, count: int) -> Ints:
    """How often each row (n,) is taken so that there are `count` in all.

    A row is taken floor(count * weight + threshold) times. Other than with systematic resampling,
    whose picks all shift when one weight changes, a row's copies depend on its own weight; the
    few that are missing or too many are those for which the count would change first.
    """
    due = count * weights + thresholds
    taken = np.floor(due)
    missing = count - int(taken.sum())
    while missing > 0:
        row = int(np.argmin((taken + 1 - due) / np.maximum(weights, _least_weight)))
        taken[row], missing = taken[row] + 1, missing - 1
    while missing < 0:
        surplus = (due - taken) / np.maximum(weights, _least_weight)
        row = int(np.argmin(np.where(taken > 0, surplus, np.inf)))
        taken[row], missing = taken[row] - 1, missing + 1
    return taken.astype(np.int32)
