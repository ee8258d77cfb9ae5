"""Table 1: object-relative navigation of the Husky in worlds of hydrants and cones."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.random import Generator

from sim.experiments.arms import ARMS, Arm
from sim.experiments.montecarlo import (
    Result,
    Scenario,
    failures_of,
    jobs_of,
    mean_row,
    progress_lines,
    run_jobs,
    success_row,
)
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.report import Outcome, Report, Row, Settings

NULL = "go to the hydrant"
BEHIND = "go to the hydrant behind the cone"
NEAREST = "go to the hydrant nearest to the cone"


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


def measure(settings: Settings) -> Outcome:
    """Every row with all arms; baselines run in a third of the worlds, in ten at least."""
    perception = PerceptionSettings()
    settings.progress(perception.summary)
    jobs = [
        job
        for row in ROWS
        for job in jobs_of(row.scenario, runs_of_arms(settings.runs), settings.seed, perception)
    ]
    results = run_jobs(jobs, settings.workers, progress_lines(settings.progress))
    rng = np.random.default_rng(settings.seed)
    rows = [made for row in ROWS for made in rows_of(row, results, rng)]
    return Outcome(tuple(rows), failures_of(results))


def runs_of_arms(runs: int) -> dict[Arm, int]:
    """Number of worlds for each arm."""
    fewer = min(runs, max(10, runs // 3))
    return {arm: runs if arm == "ours" else fewer for arm in ARMS}


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
    above.legend(fontsize=8, ncols=len(ARMS) + 1, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    title = f"Table 1, {report.runs} worlds a row, {report.git}\n{PerceptionSettings().summary}"
    figure.suptitle(title, fontsize=9)
    figure.savefig(path, dpi=150)


def _draw_metric(axes: Axes, report: Report, metric: str, label: str) -> None:
    rows = [row for row in report.rows if row.metric == metric]
    at = np.arange(len(rows))
    width = 0.8 / len(ARMS)
    for number, arm in enumerate(ARMS):
        values = [row.ours if arm == "ours" else row.arms.get(arm, np.nan) for row in rows]
        axes.bar(at + (number - 1.5) * width, values, width, label=arm.replace("_", " "))
    ours = np.array([(row.ours, *row.interval) for row in rows])
    spread = np.abs(ours[:, 1:] - ours[:, :1]).T
    axes.errorbar(at - 1.5 * width, ours[:, 0], yerr=spread, fmt="none", ecolor="k", capsize=3)
    paper = [np.nan if row.paper is None else row.paper for row in rows]
    axes.plot(at - 1.5 * width, paper, "k^", label="paper")
    axes.set_xticks(at, [row.row.replace(", ", "\n") for row in rows], fontsize=8)
    axes.set_ylabel(label)
    axes.grid(True, axis="y", alpha=0.3)
