"""The figure of `bench mapping`: how a step of the filter grows with what it has to hold."""

import re
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim.experiments.report import Report, Row

ASKED_MS = 100.0
"""For a step with 100 particles, 200 pose nodes and 20 objects on one core."""
_sizes = re.compile(r"(\d+) particles, (\d+) pose nodes, (\d+) objects")
_names = ("particles", "pose nodes", "objects")
_asked = (100, 200, 20)


def draw(report: Report, path: Path) -> None:
    """One panel each for particles, pose nodes and objects, the other two as asked for."""
    figure = Figure(figsize=(11, 3.6), layout="constrained")
    panels = figure.subplots(1, len(_names), sharey=True)
    rows = [row for row in report.rows if row.metric == "filter step, mean"]
    for which, axes in enumerate(panels):
        _draw_growth(axes, rows, which)
    panels[0].set_ylabel("filter step, mean [ms]")
    panels[0].legend(fontsize=8)
    others = ", ".join(f"{size} {name}" for size, name in zip(_asked, _names, strict=True))
    figure.suptitle(f"Growth about {others}; {report.git}, {report.machine}", fontsize=9)
    figure.savefig(path, dpi=150)


def _draw_growth(axes: Axes, rows: list[Row], which: int) -> None:
    grown = [(sizes[which], row) for row in rows if _is_growth(sizes := sizes_of(row), which)]
    grown.sort(key=lambda pair: pair[0])
    figures = np.array([(row.ours, *row.interval) for _, row in grown])
    at = [size for size, _ in grown]
    axes.plot(at, figures[:, 0], "-o", markersize=4, label="ours, 95 %")
    axes.fill_between(at, figures[:, 1], figures[:, 2], alpha=0.2)
    axes.axhline(ASKED_MS, color="k", linestyle=":", label=f"asked: {ASKED_MS:g} ms")
    axes.set(xlabel=_names[which], xlim=(0, None), ylim=(0, None))
    axes.grid(True, alpha=0.3)


def _is_growth(sizes: tuple[int, ...], which: int) -> bool:
    return all(sizes[other] == _asked[other] for other in range(len(_asked)) if other != which)


def sizes_of(row: Row) -> tuple[int, ...]:
    """Particles, pose nodes and objects that a row is about."""
    found = _sizes.match(row.row)
    return tuple(int(size) for size in found.groups()) if found else ()
