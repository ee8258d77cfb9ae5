"""Rows of where objects are said to be: errors by range, and whether their doubts are right."""

import numpy as np
from msgspec import UNSET
from numpy.random import Generator

from schemas.arrays import Floats, Ints
from sim.experiments.perception.resampling import scene_interval, scene_weights, weighted_mean
from sim.experiments.perception.space import BANDS, WITHIN_95, Placings
from sim.experiments.report import Asked, Row, rate_row

ASKED_CM = 5.0
"""Error of the middle at 2 m."""
ASKED_OF_RANGE = 3.0
"""Error of the middle up to the end of the depth sensor's range [%]."""
ASKED_CONSISTENT = 95.0
"""Normalised squared errors within their 95 % bound [%]."""
_at_2_m = BANDS[1]


def space_rows(placings: Placings, scenes: Ints, rng: Generator) -> list[Row]:
    """Small things and large ones at every range, then those that the picture cuts."""
    rows: list[Row] = []
    weights = scene_weights(scenes, rng)
    for kind in ("small", "large"):
        own = placings.whole & (placings.small == (kind == "small"))
        for band in BANDS:
            some = placings.selected(own & placings.within(band))
            rows += _band_rows(f"{kind} things, {band[0]:g} to {band[1]:g} m", band, some, weights)
    near = placings.selected(placings.ranges < BANDS[-1][1])
    rows.append(_consistent("all whole things to 7 m", near.selected(near.whole)))
    rows.append(_consistent("things that the picture cuts, to 7 m", near.selected(~near.whole)))
    return [row for row in rows if np.isfinite(row.ours)]


def _band_rows(name: str, band: tuple[float, float], some: Placings, weights: Floats) -> list[Row]:
    if not len(some.ranges):
        return []
    found = rate_row(name, "found and placed", some.placed.tolist())
    some = some.selected(some.placed)
    if not len(some.ranges):
        return [found]
    asked = ASKED_CM if band == _at_2_m else UNSET
    share = 100 * some.errors / some.ranges
    return [
        found,
        _mean(name, "centre error", "cm", 100 * some.errors, some.pictures, weights, asked),
        _mean(name, "centre error by range", "%", share, some.pictures, weights, ASKED_OF_RANGE),
        _consistent(name, some),
    ]


def _mean(
    name: str,
    metric: str,
    unit: str,
    values: Floats,
    pictures: Ints,
    weights: Floats,
    asked: Asked,
) -> Row:
    """Mean, and the median beside it: few gross errors make much of a mean."""
    return Row(
        row=name,
        metric=metric,
        unit=unit,
        better="lower",
        ours=float(values.mean()),
        interval=scene_interval(lambda weight: weighted_mean(values, weight[pictures]), weights),
        arms={"median": float(np.median(values))},
        asked=asked,
    )


def _consistent(name: str, some: Placings) -> Row:
    squared = some.squared[some.placed]
    within = (squared < WITHIN_95).tolist()
    return rate_row(name, "within the 95 % bound of its covariance", within, ASKED_CONSISTENT)
