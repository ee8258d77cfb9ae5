"""The four plots of field of view: success and distance for "behind" and "nearest"."""

from pathlib import Path

import msgspec
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim.experiments.arms import Arm
from sim.experiments.montecarlo import (
    failures_of,
    jobs_of,
    mean_row,
    progress_lines,
    run_jobs,
    success_row,
)
from sim.experiments.montecarlo_job import Scenario
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.report import Outcome, Report, Row, Settings
from sim.experiments.table1 import BEHIND, NEAREST

RANGES_M = (2.0, 3.0, 5.0, 10.0, 15.0, 20.0)
RELATIONS = {
    "behind": Scenario(
        name="behind", world="one_hydrant_one_cone", text=BEHIND, view_range_m=RANGES_M[0]
    ),
    "nearest": Scenario(
        name="nearest", world="nearest_hydrant", text=NEAREST, view_range_m=RANGES_M[0]
    ),
}
_metrics = {"success": "success [%]", "distance": "distance, all runs [m]"}


def measure(settings: Settings) -> Outcome:
    """Both relations at every range, beside the known map."""
    perception = PerceptionSettings()
    settings.progress(perception.summary)
    scenarios = [seen_to(one, reach) for one in RELATIONS.values() for reach in RANGES_M]
    runs: dict[Arm, int] = {"ours": settings.runs, "known": min(settings.runs, 10)}
    jobs = [job for one in scenarios for job in jobs_of(one, runs, settings.seed, perception)]
    results = run_jobs(jobs, settings, progress_lines(settings.progress))
    rng = np.random.default_rng(settings.seed)
    rows: list[Row] = []
    for scenario in scenarios:
        own = [one for one in results if one.scenario == scenario.name]
        rows.append(success_row(scenario.name, own))
        rows.append(mean_row(scenario.name, "distance", "m", own, lambda one: one.distance_m, rng))
    return Outcome(tuple(rows), failures_of(results))


def seen_to(scenario: Scenario, range_m: float) -> Scenario:
    """The scenario with another radius of the field of view [m]."""
    name = f"{scenario.name}, {range_m:g} m"
    return msgspec.structs.replace(scenario, name=name, view_range_m=range_m)


def draw(report: Report, path: Path) -> None:
    """Distance above success, one column for each relation, as in the paper."""
    figure = Figure(figsize=(10, 7), layout="constrained")
    panels = figure.subplots(2, len(RELATIONS), sharex=True)
    for column, relation in enumerate(RELATIONS):
        for line, metric in enumerate(("distance", "success")):
            _draw_panel(panels[line, column], report, relation, metric)
    figure.suptitle(f"Field of view, {report.runs} worlds a point, {report.git}")
    figure.savefig(path, dpi=150)


def _draw_panel(axes: Axes, report: Report, relation: str, metric: str) -> None:
    rows = [r for r in report.rows if r.metric == metric and r.row.startswith(f"{relation},")]
    ours = np.array([(row.ours, *row.interval) for row in rows])
    spread = np.abs(ours[:, 1:] - ours[:, :1]).T
    axes.errorbar(RANGES_M, ours[:, 0], yerr=spread, fmt="o-", capsize=3, label="ours, 95 %")
    axes.plot(RANGES_M, [row.arms["known"] for row in rows], "k--", label="known map")
    axes.set(title=relation, xlabel="field of view [m]", ylabel=_metrics[metric])
    axes.set_ylim(bottom=0)
    axes.grid(True, alpha=0.3)
    axes.legend(fontsize=8)
