"""Time of behaviour inference in sampled maps, against their number of objects."""

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.random import Generator
from numpy.typing import NDArray

from robots.symbols import SYMBOL_SPACES
from services.grounding.model import GroundingModel
from services.grounding.weights import weights_path
from services.grounding.world import WorldObjects
from sim.experiments.report import Outcome, Report, Row, Settings, time_row

PARTICLES = 20
"""As many as the paper's outdoor manipulation experiment had."""
COUNTS = (1, 2, 5, 11, 24, 50, 100, 200)
METRICS = {PARTICLES: f"time per particle of {PARTICLES}", 1: "time of one alone"}
PAPER_ROBOT = "husky_ur5"
PAPER_MS = {11: 19.0, 24: 35.0}
"""Mean time per particle [ms] in trials that ended with this many objects, outdoor and indoor
(paper, table:exp-husky-arm-results)."""

_half_width = 15.0
_instructions = {
    "husky": "go to the hydrant behind the cone",
    "wheelchair": "go to the kitchen that is down the hallway",
    "husky_ur5": "retrieve the ball inside the box",
}


def behavior_times_ms(
    robot: str, objects: int, runs: int, rng: Generator, particles: int = PARTICLES
) -> list[float]:
    """Time per particle of each run, every run in maps of its own [ms]."""
    model = GroundingModel.load(robot)
    understanding = model.understand(_instructions[robot])
    intent = understanding.intents[0]
    meant = [model.names.index(name) for name in (intent.object, intent.landmark)]
    sizes = (len(model.names), objects, particles)
    model.behaviors_in_belief(understanding, sample_belief(meant, *sizes, rng))
    times: list[float] = []
    for _ in range(runs):
        worlds = sample_belief(meant, *sizes, rng)
        started = time.perf_counter()
        model.behaviors_in_belief(understanding, worlds)
        times.append(1000 * (time.perf_counter() - started) / particles)
    return times


def sample_belief(
    meant: Sequence[int], names: int, objects: int, particles: int, rng: Generator
) -> tuple[WorldObjects, ...]:
    """Maps of a belief: every object but one was seen and is the same in all of them.

    Args:
        meant: classes of the first objects, so that there is something to ground.
        names: number of classes, equally frequent among the other objects.
        objects: in every map.
        particles: number of maps.
        rng: decides classes, places and sizes.
    """
    classes = np.append(meant, rng.integers(0, names, objects))[:objects]
    ground = rng.uniform(-_half_width, _half_width, (objects, 2))
    places = np.column_stack([ground, np.zeros(objects)])
    extents = rng.uniform(0.3, 2.0, (objects, 3))
    observed: NDArray[np.bool_] = np.arange(objects) > 0
    worlds: list[WorldObjects] = []
    for _ in range(particles):
        positions = places.copy()
        positions[0, :2] = rng.uniform(-_half_width, _half_width, 2)
        worlds.append(WorldObjects(classes, positions, extents, observed, np.zeros(3)))
    return tuple(worlds)


def measure(settings: Settings) -> Outcome:
    """Rows of every robot and number of objects, in a belief of 20 and in one map alone."""
    rng = np.random.default_rng(settings.seed)
    rows: list[Row] = []
    for robot in trained_robots():
        for count in COUNTS:
            settings.progress(f"{robot}: {count} objects")
            for particles, metric in METRICS.items():
                times = behavior_times_ms(robot, count, settings.runs, rng, particles)
                paper = paper_ms(robot, count)
                rows.append(time_row(f"{robot}, {count} objects", metric, times, rng, paper))
    return Outcome(tuple(rows))


def trained_robots() -> list[str]:
    """Robots that have weights."""
    return [robot for robot in SYMBOL_SPACES if weights_path(robot).exists()]


def paper_ms(robot: str, objects: int) -> float | None:
    """What the paper says of this robot and size of map, if anything."""
    return PAPER_MS.get(objects) if robot == PAPER_ROBOT else None


def draw(report: Report, path: Path) -> None:
    """The paper's figure of run-time against objects, ours and theirs on logarithmic axes."""
    figure = Figure(figsize=(7, 4.5), layout="constrained")
    axes = figure.subplots()
    for robot in dict.fromkeys(row.row.partition(",")[0] for row in report.rows):
        for metric, style in zip(METRICS.values(), ("-o", "--s"), strict=True):
            rows = [r for r in report.rows if r.row.startswith(f"{robot},") and r.metric == metric]
            ours = np.array([(row.ours, *row.interval) for row in rows])
            counts = [int(row.row.split()[-2]) for row in rows]
            (line,) = axes.plot(counts, ours[:, 0], style, label=f"{robot}: {metric}", markersize=4)
            axes.fill_between(counts, ours[:, 1], ours[:, 2], color=line.get_color(), alpha=0.2)
    axes.plot(list(PAPER_MS), list(PAPER_MS.values()), "k^", label="paper, mean of trials")
    axes.set(xscale="log", yscale="log", xlabel="objects in the map", ylabel="time [ms]")
    axes.set_title("Behavior inference")
    axes.grid(True, which="both", alpha=0.2)
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=150)
