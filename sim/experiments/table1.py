"""Table 1: object-relative navigation of the Husky in worlds of hydrants and cones."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from msgspec import structs
from numpy.random import Generator

from robots.husky.spec import HUSKY
from sim.experiments.arms import BASELINES, Arm
from sim.experiments.comparison import DISTANCE, EFFICIENCY, SUCCESS, compared
from sim.experiments.montecarlo import (
    failures_of,
    jobs_of,
    mean_row,
    progress_lines,
    run_jobs,
    success_row,
)
from sim.experiments.montecarlo_job import PARTICLES, Result, Scenario
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.report import Comparison, Outcome, Report, Row, Settings, rate_row
from sim.slip import SLIP_DEVIATION

NULL = "go to the hydrant"
BEHIND = "go to the hydrant behind the cone"
NEAREST = "go to the hydrant nearest to the cone"


_drawn: tuple[Arm, ...] = ("ours", *BASELINES)


@dataclass(frozen=True)
class TableRow:
    """A scenario and what the paper's table says about it."""

    scenario: Scenario
    success: float
    """[%]"""
    distance_m: float
    known_m: float
    """Distance with the full map known."""
    ambiguous: bool = False
    """Whether there is more than one object of the goal's class."""


def _row(
    things: str, view_range_m: float, relation: str, world: str, text: str, *paper: float
) -> TableRow:
    name = f"{things}, {view_range_m:.1f} m, {relation}"
    scenario = Scenario(name=name, world=world, text=text, view_range_m=view_range_m)
    return TableRow(scenario, *paper, ambiguous=things.startswith("2"))


def _clarified(scenario: Scenario) -> Scenario:
    return structs.replace(scenario, name=f"{scenario.name}, one answer", answers=True)


_one_one, _one_two, _two_one = "1 hydrant 1 cone", "1 hydrant 2 cones", "2 hydrants 1 cone"
ROWS = (
    _row(_one_one, 3.0, "null", "one_hydrant_one_cone", NULL, 93.9, 16.78, 8.75),
    _row(_one_one, 3.0, "behind", "one_hydrant_one_cone", BEHIND, 98.3, 13.43, 8.75),
    _row(_one_two, 3.0, "null", "one_hydrant_two_cones", NULL, 100.0, 32.54, 11.18),
    _row(_one_two, 3.0, "behind", "one_hydrant_two_cones", BEHIND, 99.5, 40.02, 11.18),
    _row(_two_one, 3.0, "null", "two_hydrants_one_cone", NULL, 54.4, 21.56, 10.49),
    _row(_two_one, 3.0, "behind", "two_hydrants_one_cone", BEHIND, 67.4, 18.72, 10.38),
    _row(_two_one, 5.0, "nearest", "nearest_hydrant", NEAREST, 46.2, 12.05, 9.19),
)

CLARIFIED = tuple(
    replace(row, scenario=_clarified(row.scenario))
    for row in ROWS
    if row.ambiguous and row.scenario.text == NULL
)
"""Rows whose words leave open what is meant, with a person to ask."""


def measure(settings: Settings) -> Outcome:
    """Every row with all arms; baselines run in a tenth of the worlds, in ten at least."""
    perception = PerceptionSettings()
    runs = runs_of(settings.runs, BASELINES)
    jobs = [j for row in ROWS for j in jobs_of(row.scenario, runs, settings.seed, perception)]
    for row in CLARIFIED:
        jobs += jobs_of(row.scenario, {"ours": settings.runs}, settings.seed, perception)
    results = run_jobs(jobs, settings, progress_lines(settings.progress))
    rng = np.random.default_rng(settings.seed)
    return Outcome(
        rows=(
            *(made for row in ROWS for made in rows_of(row, results, rng)),
            *(made for row in CLARIFIED for made in clarified_rows(row, results, rng)),
        ),
        failures=failures_of(results),
        comparisons=tuple(made for row in ROWS for made in comparisons_of(row, results, rng)),
        settings=settings_of(runs, perception),
    )


def runs_of(runs: int, others: Sequence[Arm]) -> dict[Arm, int]:
    """Number of worlds for our arm and the others."""
    fewer = min(runs, max(10, runs // 10))
    return {"ours": runs, **dict.fromkeys(others, fewer)}


def settings_of(runs: Mapping[Arm, int], perception: PerceptionSettings) -> tuple[str, ...]:
    """What the figures hold for, for people."""
    counts = ", ".join(f"{arm} {count}" for arm, count in runs.items())
    limits, odometry = HUSKY.limits, HUSKY.odometry
    return (
        f"worlds a row: {counts}; {PARTICLES} particles",
        f"base: {limits.linear_speed:g} m/s, {limits.angular_speed:g} rad/s, "
        f"slip {SLIP_DEVIATION:.0%}; odometry variance {odometry.variance_per_metre:g} a metre, "
        f"{odometry.variance_per_radian:g} a radian",
        perception.summary,
    )


def clarified_rows(row: TableRow, results: Sequence[Result], rng: Generator) -> list[Row]:
    """The figures of a row, and in how many runs a question was asked."""
    own = [one for one in results if one.scenario == row.scenario.name]
    asked = rate_row(row.scenario.name, "asked", [one.questions > 0 for one in own])
    return [*rows_of(row, results, rng), asked]


def comparisons_of(row: TableRow, results: Sequence[Result], rng: Generator) -> list[Comparison]:
    """What is asked of our arm: with a relation a better search, without one no longer a way."""
    others: list[Arm] = [arm for arm in BASELINES if arm != "known"]
    metrics = (SUCCESS, DISTANCE if row.scenario.text == NULL else EFFICIENCY)
    return compared(row.scenario.name, results, others, metrics, rng)


def rows_of(row: TableRow, results: Sequence[Result], rng: Generator) -> list[Row]:
    """Success, distance over all runs, and success weighted by path length."""
    name = row.scenario.name
    own = [one for one in results if one.scenario == name]
    made = [success_row(name, own, row.success)]
    if row.ambiguous:
        made.append(success_row(name, own, any_of_class=True))
    distance = mean_row(name, "distance", "m", own, lambda one: one.distance_m, rng, row.distance_m)
    efficiency = mean_row(name, "SPL", "", own, lambda one: one.path_efficiency, rng)
    return [*made, distance, efficiency]


def draw(report: Report, path: Path) -> None:
    """Success and distance of all arms, and the paper's."""
    figure = Figure(figsize=(13, 9), layout="constrained")
    above, below = figure.subplots(2, 1)
    _draw_metric(above, report, "success", "success [%]")
    _draw_metric(below, report, "distance", "distance, all runs [m]")
    above.legend(fontsize=8, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    title = f"Table 1, {report.runs} worlds a row, {report.git}\n{PerceptionSettings().summary}"
    figure.suptitle(title, fontsize=9)
    figure.savefig(path, dpi=150)


def _draw_metric(axes: Axes, report: Report, metric: str, label: str) -> None:
    rows = [row for row in report.rows if row.metric == metric]
    at = np.arange(len(rows))
    width = 0.8 / len(_drawn)
    first = at - (len(_drawn) - 1) / 2 * width
    for number, arm in enumerate(_drawn):
        values = [row.ours if arm == "ours" else row.arms.get(arm, np.nan) for row in rows]
        axes.bar(
            at + (number - (len(_drawn) - 1) / 2) * width,
            values,
            width,
            label=arm.replace("_", " "),
        )
    ours = np.array([(row.ours, *row.interval) for row in rows])
    spread = np.abs(ours[:, 1:] - ours[:, :1]).T
    axes.errorbar(
        first,
        ours[:, 0],
        yerr=spread,
        fmt="none",
        ecolor="k",
        capsize=3,
    )
    paper = [np.nan if row.paper is None else row.paper for row in rows]
    axes.plot(first, paper, "k^", label="paper")
    axes.set_xticks(at, [row.row.replace(", ", "\n") for row in rows], fontsize=8)
    axes.set_ylabel(label)
    axes.grid(True, axis="y", alpha=0.3)
