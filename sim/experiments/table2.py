"""Table 2: "go to the kitchen that is down the hallway" with the wheelchair, on unknown floors.

A run succeeds if the robot declares the goal reached and stands inside the kitchen, or within 1.5 m
of its middle, without having touched a wall. Every run counts in every figure, failures included.
The known map is driven on what RRT* finds, as in the paper, to the middle of the kitchen.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.random import Generator

from robots.wheelchair.spec import WHEELCHAIR
from schemas.arrays import Floats
from sim.experiments.arms import Arm
from sim.experiments.comparison import DISTANCE, EFFICIENCY, SUCCESS, Measured, compared
from sim.experiments.montecarlo import failures_of, jobs_of, mean_interval, progress_lines, run_jobs
from sim.experiments.montecarlo_job import PARTICLES, Result, Scenario
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.report import (
    RESAMPLES,
    Better,
    Interval,
    Outcome,
    Report,
    Row,
    Settings,
    rate_row,
)
from sim.scenes.office import GOAL
from sim.slip import SLIP_DEVIATION

TEXT = "go to the kitchen that is down the hallway"
TIME: Measured = ("time", "s", "lower", lambda one: one.time_s)
PAPER: dict[tuple[str, Arm], tuple[float, float]] = {
    ("distance", "known"): (12.88, 0.06),
    ("distance", "ours"): (16.64, 6.84),
    ("distance", "without_language"): (25.28, 12.99),
    ("time", "known"): (18.32, 3.54),
    ("time", "ours"): (82.78, 10.56),
    ("time", "without_language"): (85.57, 17.80),
}
"""Mean and standard deviation over the paper's ten runs."""
TITLES: dict[Arm, str] = {
    "ours": "ours",
    "known": "known map",
    "without_language": "without language",
    "frontier": "nearest frontier",
}


def _scenario(name: str, world: str) -> Scenario:
    return Scenario(
        name=name, robot="wheelchair", world=world, text=TEXT, view_range_m=0.0, goal=GOAL
    )


SCENARIOS = (
    _scenario("office", "office"),
    _scenario("office, any heading", "office_turned"),
    _scenario("office, longer wrong hall", "office_long"),
)
"""The paper's table is the first; the others are harder and met by fewer runs."""


def measure(settings: Settings) -> Outcome:
    """The paper's table with all runs of every arm, and the harder floors with a fifth of them."""
    perception = PerceptionSettings()
    fewer = min(settings.runs, max(10, settings.runs // 5))
    jobs = [
        job
        for number, scenario in enumerate(SCENARIOS)
        for job in jobs_of(
            scenario,
            dict.fromkeys(TITLES, settings.runs if number == 0 else fewer),
            settings.seed,
            perception,
        )
    ]
    results = run_jobs(jobs, settings, progress_lines(settings.progress))
    rng = np.random.default_rng(settings.seed)
    return Outcome(
        rows=tuple(row for scenario in SCENARIOS for row in rows_of(scenario, results, rng)),
        failures=failures_of(results),
        comparisons=tuple(
            made
            for scenario in SCENARIOS
            for made in compared(
                scenario.name,
                results,
                [arm for arm in TITLES if arm != "ours"],
                (SUCCESS, DISTANCE, TIME, EFFICIENCY),
                rng,
            )
        ),
        settings=settings_of(settings.runs, fewer, perception),
    )


def rows_of(scenario: Scenario, results: Sequence[Result], rng: Generator) -> list[Row]:
    """Distance, time, success and SPL of every arm, and ours as a multiple of the known map's."""
    own = [one for one in results if one.scenario == scenario.name]
    rows: list[Row] = []
    paper = PAPER if scenario is SCENARIOS[0] else {}
    for arm, title in TITLES.items():
        runs, name = [one for one in own if one.arm == arm], f"{scenario.name}, {title}"
        for measured in (DISTANCE, TIME):
            rows += _mean_and_deviation(name, measured, runs, paper.get((measured[0], arm)), rng)
        rows.append(rate_row(name, "success", [one.success for one in runs]))
        efficiencies = [one.path_efficiency for one in runs]
        rows.append(_row(name, EFFICIENCY, float(np.mean(efficiencies)), None,
                         mean_interval(efficiencies, rng)))  # fmt: skip
    return rows + [_share_of_known(scenario.name, one, own, paper, rng) for one in (DISTANCE, TIME)]


def _mean_and_deviation(
    name: str,
    measured: Measured,
    runs: Sequence[Result],
    paper: tuple[float, float] | None,
    rng: Generator,
) -> list[Row]:
    metric, unit, better, value = measured
    values = np.array([value(one) for one in runs])
    mean, deviation = paper or (None, None)
    spread: Measured = (f"{metric}, standard deviation", unit, better, value)
    return [
        _row(name, measured, float(values.mean()), mean, mean_interval(values.tolist(), rng)),
        _row(name, spread, float(values.std()), deviation, _interval_of(np.std, values, rng)),
    ]


def _share_of_known(
    name: str,
    measured: Measured,
    results: Sequence[Result],
    paper: dict[tuple[str, Arm], tuple[float, float]],
    rng: Generator,
) -> Row:
    """Mean of ours by that of the known map, in the same worlds."""
    metric, _, _, value = measured
    by_seed = {
        arm: {one.seed: value(one) for one in results if one.arm == arm}
        for arm in ("ours", "known")
    }
    seeds = sorted(by_seed["ours"].keys() & by_seed["known"].keys())
    pairs = np.array([(by_seed["ours"][seed], by_seed["known"][seed]) for seed in seeds])
    ours, known = (paper.get((metric, arm)) for arm in ("ours", "known"))
    share: Measured = (f"{metric} by the known map's", "", "lower", value)
    return _row(
        f"{name}, ours",
        share,
        float(_ratio(pairs)),
        ours[0] / known[0] if ours and known else None,
        _interval_of(_ratio, pairs, rng),
    )


def _ratio(pairs: Floats) -> np.floating:
    return pairs[:, 0].mean() / pairs[:, 1].mean()


def _interval_of(
    figure: Callable[[Floats], np.floating], samples: Floats, rng: Generator
) -> Interval:
    """95 % percentile interval of a figure, by resampling with replacement (Efron, 1979)."""
    drawn = rng.integers(0, len(samples), (RESAMPLES, len(samples)))
    low, high = np.quantile([figure(samples[rows]) for rows in drawn], [0.025, 0.975])
    return float(low), float(high)


def _row(
    name: str, measured: Measured, value: float, paper: float | None, interval: Interval
) -> Row:
    metric, unit, better, _ = measured
    better_way: Better = better
    return Row(
        row=name, metric=metric, unit=unit, better=better_way, paper=paper, ours=value,
        interval=interval,
    )  # fmt: skip


def settings_of(runs: int, fewer: int, perception: PerceptionSettings) -> tuple[str, ...]:
    """What the figures hold for, for people."""
    base, limits, odometry = WHEELCHAIR.base, WHEELCHAIR.limits, WHEELCHAIR.odometry
    camera, laser = WHEELCHAIR.camera, WHEELCHAIR.laser
    return (
        f"worlds: {runs}, of the harder floors {fewer}; mirrored and turned by seed; "
        f"{PARTICLES} particles",
        f"base {base.length:g} x {base.width:g} m, {limits.linear_speed:g} m/s, "
        f"{limits.angular_speed:g} rad/s, slip {SLIP_DEVIATION:.0%}; odometry variance "
        f"{odometry.variance_per_metre:g} a metre, {odometry.variance_per_radian:g} a radian",
        f"camera {np.degrees(camera.horizontal_fov):.0f} degrees, {camera.range_max:g} m; "
        f"laser all round, {laser.range_max:g} m",
        perception.summary,
        perception.places.summary,
    )


def draw(report: Report, path: Path) -> None:
    """Distance and time of every arm on every floor, and the paper's."""
    figure = Figure(figsize=(11, 8), layout="constrained")
    above, below = figure.subplots(2, 1)
    _draw_metric(above, report, "distance", "distance, all runs [m]")
    _draw_metric(below, report, "time", "time, all runs [s]")
    above.legend(fontsize=8, ncols=5, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    lines = "\n".join(report.settings)
    figure.suptitle(f"Table 2, {report.runs} worlds, {report.git}\n{lines}", fontsize=7)
    figure.savefig(path, dpi=150)


def _draw_metric(axes: Axes, report: Report, metric: str, label: str) -> None:
    rows = {row.row: row for row in report.rows if row.metric == metric}
    at, width = np.arange(len(SCENARIOS)), 0.8 / len(TITLES)
    for number, title in enumerate(TITLES.values()):
        own = [rows[f"{scenario.name}, {title}"] for scenario in SCENARIOS]
        place = at + (number - (len(TITLES) - 1) / 2) * width
        means = np.array([row.ours for row in own])
        ends = np.array([row.interval for row in own])
        spread = np.abs(ends - means[:, None]).T
        axes.bar(place, means, width, label=title)
        axes.errorbar(place, means, yerr=spread, fmt="none", ecolor="k", capsize=3)
        paper = [np.nan if row.paper is None else row.paper for row in own]
        axes.plot(place, paper, "k^", label="paper" if number == 0 else None)
    axes.set_xticks(at, [scenario.name for scenario in SCENARIOS])
    axes.set_ylabel(label)
    axes.grid(True, axis="y", alpha=0.3)
