"""How the belief of one run grows: what is imagined, what was seen, and what candidates cost.

As the figure of the value function in the paper. Everything is read from the log of the run.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PathCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from schemas import topics
from schemas.belief import MapBelief, OccupancyGrid
from schemas.codec import decode
from schemas.run import RunConfig
from schemas.task import Decision
from services.runtime.log_file import read_log
from sim.experiments.episode import Episode, Trial
from sim.experiments.montecarlo import REACHED_M
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.report import Outcome, Report, Row, Settings
from sim.experiments.table1 import ROWS

SCENARIO = ROWS[1].scenario
"""A hydrant behind a cone, seen from 3 m."""
PANELS = 4
_dearest = 4.0
"""Candidates that cost more than this many times the cheapest are drawn alike."""
_colors = {"hydrant": "tab:red", "cone": "tab:orange"}


@dataclass(frozen=True)
class Snapshot:
    """What was believed when a decision was taken."""

    belief: MapBelief
    grid: OccupancyGrid
    decision: Decision

    @property
    def seconds(self) -> float:
        """Since the start of the run."""
        return self.decision.stamp_ns / 1e9

    @property
    def chosen(self) -> str:
        """Kind of the candidate that was taken."""
        return self.decision.kinds[self.decision.chosen]

    @property
    def confirmed(self) -> float:
        """Share of hypotheses in which all that was spoken of was seen."""
        belief = self.belief
        seen = belief.node[belief.seen]
        found = np.isin(belief.figure, seen) & np.isin(belief.landmark, seen)
        return float(belief.weights[found].sum())


def measure(settings: Settings) -> Outcome:
    """How sure the robot is, decision by decision."""
    settings.progress(f"{SCENARIO.text!r} in world {SCENARIO.world} {settings.seed}")
    rows = [
        Row(
            row=f"decision {number} at {one.seconds:.0f} s, {one.chosen}",
            metric="hypotheses confirmed",
            unit="%",
            better="higher",
            ours=100 * one.confirmed,
            interval=(100 * one.confirmed, 100 * one.confirmed),
        )
        for number, one in enumerate(run_snapshots(settings.seed), start=1)
    ]
    return Outcome(tuple(rows), settings=(PerceptionSettings().summary,))


def run_snapshots(seed: int) -> list[Snapshot]:
    """One episode, logged and read back."""
    run = RunConfig(
        world=SCENARIO.world,
        seed=seed,
        view_range_m=SCENARIO.view_range_m,
        view_fov_rad=SCENARIO.view_fov_rad,
    )
    trial = Trial(perception=PerceptionSettings(), intended=(SCENARIO.goal,), reached_m=REACHED_M)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "belief.mcap"
        Episode(run, SCENARIO.text, log, trial).run(lambda seconds, status: None)
        return snapshots_of(log)


def snapshots_of(log: Path) -> list[Snapshot]:
    """Every decision in a log, with the belief that it was taken on and the newest grid."""
    beliefs: dict[int, MapBelief] = {}
    grid: OccupancyGrid | None = None
    found: list[Snapshot] = []
    for record in read_log(log):
        if record.topic == topics.BELIEF.key:
            belief = decode(record.data, MapBelief)
            beliefs[belief.stamp_ns] = belief
        elif record.topic == topics.GRID.key:
            grid = decode(record.data, OccupancyGrid)
        elif record.topic == topics.DECISION.key:
            decision = decode(record.data, Decision)
            if grid is not None and decision.stamp_ns in beliefs:
                found.append(Snapshot(beliefs[decision.stamp_ns], grid, decision))
    return found


def draw(report: Report, path: Path) -> None:
    """The run of the report at a few decisions, the first and the last among them."""
    draw_snapshots(run_snapshots(report.seed), path, f"{SCENARIO.text}, {report.git}")


def draw_snapshots(snapshots: Sequence[Snapshot], path: Path, title: str) -> None:
    """One panel for each of `PANELS` decisions, spread over the run."""
    picks = np.unique(np.linspace(0, len(snapshots) - 1, PANELS).round().astype(int))
    figure = Figure(figsize=(4.2 * len(picks), 4.8), layout="constrained")
    panels = figure.subplots(1, len(picks), squeeze=False, sharex=True, sharey=True)[0]
    for axes, pick in zip(panels, picks, strict=True):
        _draw(axes, snapshots[pick])
    scale = ScalarMappable(Normalize(1.0, _dearest), "viridis_r")
    figure.colorbar(scale, ax=list(panels), label="cost, as multiple of the cheapest", shrink=0.7)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8)
    figure.suptitle(title, fontsize=10)
    figure.savefig(path, dpi=150)


def _draw(axes: Axes, snapshot: Snapshot) -> None:
    belief, grid = snapshot.belief, snapshot.grid
    height, width = grid.looked.shape
    x0, y0 = grid.origin
    extent = (x0, x0 + width * grid.resolution, y0, y0 + height * grid.resolution)
    axes.imshow(-grid.looked, origin="lower", extent=extent, cmap="Greens", vmin=0, vmax=90)
    _draw_things(axes, belief)
    _draw_candidates(axes, snapshot.decision)
    trail = belief.trajectory
    pose = belief.map_from_base
    axes.plot([*trail[:, 0], pose.x], [*trail[:, 1], pose.y], "-", color="tab:blue", lw=1)
    axes.plot(pose.x, pose.y, "o", color="tab:blue", ms=9, label="robot")
    axes.set(
        title=f"{snapshot.seconds:.0f} s: {snapshot.chosen}, {snapshot.confirmed:.0%} confirmed",
        xlim=(-3, 17), ylim=(-11, 11), aspect="equal", xlabel="x [m]",
    )  # fmt: skip


def _draw_things(axes: Axes, belief: MapBelief) -> None:
    """Open circles for what is imagined, filled squares for what was seen."""
    for name, color in _colors.items():
        rows = belief.class_index == belief.classes.index(name)
        imagined, seen = belief.position[rows & ~belief.seen], belief.position[rows & belief.seen]
        open_ones: dict[str, Any] = {"facecolors": "none", "edgecolors": color, "alpha": 0.6}
        axes.scatter(*imagined.T, s=22, label=f"{name}, imagined", **open_ones)
        axes.scatter(
            *seen.T, s=110, marker="s", color=color, edgecolors="k", label=f"{name}, seen", zorder=4
        )


def _draw_candidates(axes: Axes, decision: Decision) -> PathCollection:
    """Where candidates lead, the cheapest dark, and a star where the robot goes."""
    moves = np.array([kind != "stop" for kind in decision.kinds])
    least = max(float(decision.costs[decision.chosen]), 1e-9)
    shade = np.clip(decision.costs / least, 1.0, _dearest)
    chosen = decision.positions[decision.chosen]
    axes.plot(*chosen, "*", color="magenta", mec="k", ms=15, zorder=5, label="chosen")
    return axes.scatter(
        *decision.positions[moves].T, c=shade[moves], cmap="viridis_r", vmin=1.0, vmax=_dearest,
        marker="D", s=34, edgecolors="w", linewidths=0.5, zorder=3, label="candidate",
    )  # fmt: skip
