"""Learns `services.perception.space.forms` from rendered things whose true places are known.

Weighted least squares for each class, drawn towards the fit to all classes together, so that few
examples do not go astray; examples far off (another thing was measured) count for little. The
variance of what is left is linear in the doubts, with weights that are not negative.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from schemas.arrays import Flags, Floats
from services.perception.space.forms import ANY, DOUBTS, Form, FormTable, Numbers, doubts_of
from services.perception.space.surface import MEASURES, MIRRORED, Surface

_rounds = 10
_folds = 5
_draw = 2.0
"""Examples' worth of the pull towards the fit of all classes."""
_scale = 2.0
"""Residuals of so many deviations count half (Cauchy)."""
_least_spread = 0.003
_widest = 5.0
"""Residuals count up to so many deviations in the variance."""
_least_variance = 0.008**2
"""A straight line through what is curved is wrong by about so much [m^2]."""
_median_of_chi2, _within_95 = 0.455, 3.84
"""Of a squared normal variable: median, and what 95 % lie below."""
_least_examples = 20
_signed = np.array([False, True, False])
"""Of along, across and up: what changes sign in a mirror."""


@dataclass(frozen=True)
class Example:
    """A surface and the whole thing that it belongs to."""

    label: str
    surface: Surface
    center: Floats
    """(3,) true middle of its box, base frame [m]."""
    size: Floats
    """(3,) true length >= width, and height [m]."""
    yaw: float = 0.0
    """True direction of the length in the base frame [rad]; only judging reads it."""


def learn_forms(examples: Sequence[Example], source: str) -> FormTable:
    """Forms of every class with enough examples, and of any."""
    pooled = _form(examples, None)
    forms = {ANY: pooled}
    for label in sorted({one.label for one in examples}):
        own = [one for one in examples if one.label == label]
        if len(own) >= _least_examples:
            forms[label] = _form(own, pooled)
    return FormTable(source=source, measures=MEASURES, doubts=DOUBTS, forms=forms)


def _form(examples: Sequence[Example], towards: Form | None) -> Form:
    measures = np.stack([one.surface.measures for one in examples])
    doubts = np.stack([doubts_of(one.surface) for one in examples])
    beyond = np.stack([one.surface.axes.T @ (one.center - one.surface.anchor) for one in examples])
    size = np.stack([one.size for one in examples])
    nowhere = np.zeros((3, len(MEASURES)))
    centers = np.array(towards.center) if towards else nowhere
    sizes = np.array(towards.size) if towards else nowhere
    center, variance = list[Floats](), list[Floats]()
    for axis in range(3):
        used = MIRRORED if _signed[axis] else ~MIRRORED
        center.append(_fit(measures, beyond[:, axis], centers[axis], used))
        left = _left_out(measures, beyond[:, axis], centers[axis], used)
        variance.append(_variance(doubts, left))
    return Form(
        examples=len(examples),
        center=_rows(center),
        size=_rows([_fit(measures, size[:, axis], sizes[axis], ~MIRRORED) for axis in range(3)]),
        variance=_rows(variance),
    )


def _left_out(measures: Floats, wanted: Floats, start: Floats, used: Flags) -> Floats:
    """Residuals of examples that the weights were not fitted to, in turn."""
    fold = np.arange(len(wanted)) % _folds
    left = np.zeros_like(wanted)
    for number in range(_folds):
        out = fold == number
        weights = _fit(measures[~out], wanted[~out], start, used)
        left[out] = wanted[out] - measures[out] @ weights
    return left


def _fit(measures: Floats, wanted: Floats, start: Floats, used: Flags) -> Floats:
    """Weights of the measures; those that are not used stay 0."""
    design = measures[:, used]
    weights, count = start[used].copy(), np.ones(len(wanted))
    # A measure's pull is in its own unit, so that a weight of a small measure is as free.
    pull = _draw * np.diag(np.mean(design**2, axis=0) + 1e-6)
    for _ in range(_rounds):
        weighted = design * count[:, None]
        off = weighted.T @ (wanted - design @ start[used])
        weights = start[used] + np.linalg.solve(weighted.T @ design + pull, off)
        left = wanted - design @ weights
        spread = 1.4826 * np.median(np.abs(left)) + _least_spread
        count = 1 / (1 + (left / (_scale * spread)) ** 2)
    result = np.zeros(len(used))
    result[used] = weights
    return result


def _variance(doubts: Floats, left: Floats) -> Floats:
    """Weights of the doubts, not negative, with which squared residuals are expected.

    Residuals have longer tails than the normal distribution that a filter takes them for: the
    variance is made so wide that it holds 95 % of them in the interval that it should.
    """
    weights = np.array([float(np.median(left**2)) / _median_of_chi2, 0, 0, 0, 0])
    for _ in range(_rounds):
        expected = np.maximum(doubts @ weights, _least_variance)
        squared = np.minimum(left**2, _widest**2 * expected)
        # Each example counts by what is expected of it: large variances must not outweigh small.
        weights, _ = nnls(doubts / expected[:, None], squared / expected)
        weights[0] = max(weights[0], _least_variance)
    held = float(np.quantile(left**2 / (doubts @ weights), 0.95))
    return weights * max(1.0, held / _within_95)


def _rows(three: Sequence[Floats]) -> tuple[Numbers, Numbers, Numbers]:
    first, second, third = (tuple(float(f"{value:.5g}") for value in row) for row in three)
    return first, second, third
