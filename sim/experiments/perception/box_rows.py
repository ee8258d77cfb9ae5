"""Rows of what a network finds in pictures: precision, calibration, and inventions."""

from collections.abc import Sequence

import numpy as np
from msgspec import UNSET
from numpy.random import Generator
from scipy.stats import chi2

from schemas.arrays import Floats
from services.perception.training.detector.evaluation import (
    Labelled,
    Ranked,
    near_side,
    outcomes,
)
from sim.experiments.perception.boxes import HALF, BoxFigures
from sim.experiments.perception.resampling import scene_interval, scene_weights
from sim.experiments.report import Asked, Interval, Row, rate_row

ASKED_MAP50, ASKED_MAP50_95 = 0.95, 0.70
ASKED_CALIBRATION_ERROR = 0.05
ASKED_FALSE = 1.0
"""Boxes in a hundred pictures that show none of the classes."""


def box_rows(figures: BoxFigures, rng: Generator) -> list[Row]:
    """Precision of all classes and of each, and calibration."""
    weights = scene_weights(figures.scenes, rng)
    every = [table for of_class in figures.tables for table in of_class]
    halves = [of_class[HALF] for of_class in figures.tables]
    name = f"all {len(figures.shown)} classes"
    rows = [
        _precision(name, "mAP50", halves, weights, ASKED_MAP50),
        _precision(name, "mAP50-95", every, weights, ASKED_MAP50_95),
        _precision(f"{name}, {near_side:g} px and more", "mAP50", figures.near, weights),
        _calibration(figures, weights),
    ]
    for name, tables in zip(figures.shown, figures.tables, strict=True):
        rows.append(_precision(name, "AP50", [tables[HALF]], weights))
        rows.append(_precision(name, "AP50-95", tables, weights))
    return [row for row in rows if np.isfinite(row.ours)]


def false_row(found: int, pictures: int) -> Row:
    """Boxes in pictures that show none of the classes, with the interval of a Poisson count."""
    scale = 100 / max(pictures, 1)
    low, high = poisson_interval(found)
    return Row(
        row=f"detector, {pictures} pictures of distractors alone",
        metric="found in 100 of them",
        unit="",
        better="lower",
        ours=scale * found,
        interval=(scale * low, scale * high),
        asked=ASKED_FALSE,
    )


def poisson_interval(count: int) -> Interval:
    """95 % interval of the mean of a count (Garwood, 1936)."""
    low = float(chi2.ppf(0.025, 2 * count)) / 2 if count else 0.0
    return low, float(chi2.ppf(0.975, 2 * count + 2)) / 2


def mean_precision(tables: Sequence[Ranked], weights: Floats | None = None) -> float:
    """Mean over the tables that have objects; not a number without any."""
    values = np.array([table.average_precision(weights) for table in tables])
    known = np.isfinite(values)
    return float(values[known].mean()) if known.any() else float("nan")


def _precision(
    row: str, metric: str, tables: Sequence[Ranked], weights: Floats, asked: Asked = UNSET
) -> Row:
    return Row(
        row=f"detector, {row}",
        metric=metric,
        unit="",
        better="higher",
        ours=mean_precision(tables),
        interval=scene_interval(lambda weight: mean_precision(tables, weight), weights),
        asked=asked,
    )


def _calibration(figures: BoxFigures, weights: Floats) -> Row:
    claims = figures.claims
    return Row(
        row="detector, probability of the class named",
        metric="calibration error",
        unit="",
        better="lower",
        ours=claims.calibration_error(),
        interval=scene_interval(claims.calibration_error, weights),
        asked=ASKED_CALIBRATION_ERROR,
    )


def working_rows(pictures: Sequence[Labelled]) -> list[Row]:
    """Of boxes that reach the working threshold: how many are right, and what is found."""
    correct = outcomes(pictures).correct
    missed = sum(len(one.true_classes) for one in pictures) - int(correct.sum())
    row = "detector, working threshold"
    return [
        rate_row(row, "boxes that are right", correct.tolist()),
        rate_row(row, "objects found", [True] * int(correct.sum()) + [False] * missed),
    ]
