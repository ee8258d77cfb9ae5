"""Intervals by resampling whole scenes: pictures of one scene are alike (Efron, 1979)."""

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from schemas.arrays import Floats, Ints
from sim.experiments.report import Interval

RESAMPLES = 200


def scene_weights(scenes: Ints, rng: Generator) -> Floats:
    """How often each of P pictures counts (R, P) when their scenes (P,) are drawn anew."""
    which, index = np.unique(scenes, return_inverse=True)
    count = max(len(which), 1)
    drawn = rng.multinomial(count, np.full(count, 1 / count), RESAMPLES)
    return drawn[:, index].astype(np.float64)


def scene_interval(figure: Callable[[Floats], float], weights: Floats) -> Interval:
    """95 % percentile interval of a figure of weighted pictures, `weights` (R, P)."""
    values = np.array([figure(row) for row in weights])
    values = values[np.isfinite(values)]
    if not len(values):
        return float("nan"), float("nan")
    low, high = np.quantile(values, [0.025, 0.975])
    return float(low), float(high)


def weighted_mean(values: Floats, weights: Floats) -> float:
    """Not a number where nothing counts."""
    total = float(weights.sum())
    return float(values @ weights) / total if total > 0 else float("nan")


def quantile_interval(values: Floats, q: float, rng: Generator) -> Interval:
    """95 % percentile interval of a quantile of independent values."""
    drawn = values[rng.integers(0, len(values), (RESAMPLES, len(values)))]
    low, high = np.quantile(np.quantile(drawn, q, axis=1), [0.025, 0.975])
    return float(low), float(high)
