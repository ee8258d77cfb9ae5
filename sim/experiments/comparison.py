"""Ours against another arm in the same worlds: what luck with worlds cannot explain."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.random import Generator

from sim.experiments.arms import Arm
from sim.experiments.montecarlo import mean_interval
from sim.experiments.montecarlo_job import Result
from sim.experiments.report import Better, Comparison

Measured = tuple[str, str, Better, Callable[[Result], float]]
"""Metric, unit, which way is better, and its value in one run."""

SUCCESS: Measured = ("success", "%", "higher", lambda one: 100.0 * one.success)
EFFICIENCY: Measured = ("SPL", "", "higher", lambda one: one.path_efficiency)
DISTANCE: Measured = ("distance", "m", "lower", lambda one: one.distance_m)


def compared(
    scenario: str,
    results: Sequence[Result],
    arms: Sequence[Arm],
    metrics: Sequence[Measured],
    rng: Generator,
) -> list[Comparison]:
    """Ours with each arm by each metric, over the worlds of a scenario that both met."""
    own = [one for one in results if one.scenario == scenario]
    return [
        _paired(scenario, own, arm, measured, rng)
        for measured in metrics
        for arm in arms
        if any(one.arm == arm for one in own)
    ]


def _paired(
    scenario: str, results: Sequence[Result], arm: Arm, measured: Measured, rng: Generator
) -> Comparison:
    metric, unit, better, value = measured
    ours = {one.seed: value(one) for one in results if one.arm == "ours"}
    theirs = {one.seed: value(one) for one in results if one.arm == arm}
    worlds = sorted(ours.keys() & theirs.keys())
    differences = [ours[seed] - theirs[seed] for seed in worlds]
    return Comparison(
        row=scenario,
        metric=metric,
        unit=unit,
        better=better,
        arm=arm,
        worlds=len(worlds),
        ours=float(np.mean([ours[seed] for seed in worlds])),
        theirs=float(np.mean([theirs[seed] for seed in worlds])),
        difference=float(np.mean(differences)),
        interval=mean_interval(differences, rng),
    )
