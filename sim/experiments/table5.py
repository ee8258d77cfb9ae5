"""Table 5: "retrieve the ball inside the box" with a Husky that has an arm, indoors and outdoors.

A run succeeds if the robot says so and stands within a metre of where it began, the ball truly
between its fingers. Every run counts in every figure, failures included. The paper reports the
time of one task in each of two worlds, and no rate of success; the random worlds are ours. The
known map is the same robot with the true map in the place of the filter. Without language it knows
the class of what is wanted alone, and has no reason to look into anything.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.random import Generator

from robots.husky_ur5.spec import HUSKY_UR5
from sim.experiments.arms import Arm
from sim.experiments.body_model import BodySettings
from sim.experiments.comparison import DISTANCE, EFFICIENCY, SUCCESS, Measured, compared
from sim.experiments.montecarlo import (
    by_arm,
    failures_of,
    mean_interval,
    progress_lines,
    run_jobs,
    success_row,
)
from sim.experiments.montecarlo_job import Job, Result, Scenario
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.report import Outcome, Report, Row, Settings
from sim.scenes.boxes import INDOORS, OUTDOORS, Site

TEXT = "retrieve the ball inside the box"
TIME: Measured = ("time", "s", "lower", lambda one: one.time_s)
ARMS: tuple[Arm, ...] = ("ours", "known", "without_language")
PAPER_TIME = {"box_indoor": 351.2, "box_outdoor": 593.5}
"""Of the first task [s]."""
PARTICLES = {INDOORS: 10, OUTDOORS: 20}
"""The paper's."""


def _scenario(name: str, world: str, site: Site) -> Scenario:
    return Scenario(
        name=name,
        robot=HUSKY_UR5.name,
        world=world,
        text=TEXT,
        view_range_m=site.horizon,
        view_fov_rad=HUSKY_UR5.camera.horizontal_fov,
        goal="ball_1",
    )


SCENARIOS: dict[Site, tuple[Scenario, ...]] = {
    INDOORS: (
        _scenario("indoor", "box_indoor", INDOORS),
        _scenario("indoor, 1 to 5 boxes", "boxes_indoor", INDOORS),
    ),
    OUTDOORS: (
        _scenario("outdoor", "box_outdoor", OUTDOORS),
        _scenario("outdoor, 1 to 5 boxes", "boxes_outdoor", OUTDOORS),
    ),
}


def measure(settings: Settings) -> Outcome:
    """All worlds with all arms."""
    results = run_jobs(jobs_of(settings), settings, progress_lines(settings.progress))
    rng = np.random.default_rng(settings.seed)
    every = [one for group in SCENARIOS.values() for one in group]
    return Outcome(
        rows=tuple(row for scenario in every for row in rows_of(scenario, results, rng)),
        failures=failures_of(results),
        comparisons=tuple(
            made
            for scenario in every
            for made in compared(
                scenario.name, results, ARMS[1:], (SUCCESS, TIME, DISTANCE, EFFICIENCY), rng
            )
        ),
        settings=(
            f"worlds: {settings.runs} of each kind; particles "
            + ", ".join(f"{count}" for count in PARTICLES.values()),
            f"camera {np.degrees(HUSKY_UR5.camera.horizontal_fov):.0f} degrees, trusted "
            f"{INDOORS.horizon:g} m indoors and {OUTDOORS.horizon:g} m outdoors",
            BodySettings().summary,
        ),
    )


def jobs_of(settings: Settings) -> list[Job]:
    """Every arm meets the same worlds."""
    return [
        Job(scenario, arm, settings.seed + index, PerceptionSettings(), PARTICLES[site])
        for site, group in SCENARIOS.items()
        for scenario in group
        for arm in ARMS
        for index in range(settings.runs)
    ]


def rows_of(scenario: Scenario, results: Sequence[Result], rng: Generator) -> list[Row]:
    """Success, time, distance and SPL, the other arms' beside ours."""
    own = [one for one in results if one.scenario == scenario.name]
    paper = PAPER_TIME.get(scenario.world)
    return [
        success_row(scenario.name, own),
        _mean(scenario.name, TIME, own, paper, rng),
        _mean(scenario.name, DISTANCE, own, None, rng),
        _mean(scenario.name, EFFICIENCY, own, None, rng),
    ]


def _mean(
    name: str,
    measured: Measured,
    results: Sequence[Result],
    paper: float | None,
    rng: Generator,
) -> Row:
    metric, unit, better, value = measured
    values = {arm: [value(one) for one in runs] for arm, runs in by_arm(results).items()}
    ours = values.pop("ours")
    return Row(
        row=name, metric=metric, unit=unit, better=better, paper=paper,
        ours=float(np.mean(ours)), interval=mean_interval(ours, rng),
        arms={arm: float(np.mean(runs)) for arm, runs in values.items()},
    )  # fmt: skip


def draw(report: Report, path: Path) -> None:
    """Success and time of every arm in every kind of world, and the paper's times."""
    figure = Figure(figsize=(11, 7), layout="constrained")
    for axes, metric, label in zip(
        figure.subplots(2, 1), ("success", "time"), ("success [%]", "time [s]"), strict=True
    ):
        rows = [row for row in report.rows if row.metric == metric]
        at, width = np.arange(len(rows)), 0.25
        for number, arm in enumerate(ARMS):
            heights = [row.ours if arm == "ours" else (row.arms or {})[arm] for row in rows]
            axes.bar(at + (number - 1) * width, heights, width, label=arm.replace("_", " "))
        paper = [np.nan if row.paper is None else row.paper for row in rows]
        axes.plot(at, paper, "k^", label="paper")
        axes.set_xticks(at, [row.row for row in rows])
        axes.set_ylabel(label)
        axes.grid(True, axis="y", alpha=0.3)
    figure.axes[0].legend(fontsize=8, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    lines = "\n".join(report.settings)
    figure.suptitle(f"Table 5, {report.runs} worlds, {report.git}\n{lines}", fontsize=7)
    figure.savefig(path, dpi=150)
