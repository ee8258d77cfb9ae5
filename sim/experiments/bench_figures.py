"""A figure of any report: ours with its interval, the paper's and the peer's beside it."""

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from msgspec import UNSET

from sim.experiments.report import Report, Row


def draw_rows(report: Report, path: Path) -> None:
    """One panel a unit, one line a row; the file's suffix says the format."""
    units = list(dict.fromkeys(row.unit for row in report.rows))
    groups = [[row for row in report.rows if row.unit == unit] for unit in units]
    heights = [len(group) + 1 for group in groups]
    figure = Figure(figsize=(9, 1 + 0.3 * sum(heights)), layout="constrained")
    panels = figure.subplots(len(groups), squeeze=False, height_ratios=heights)[:, 0]
    for axes, unit, rows in zip(panels, units, groups, strict=True):
        _draw_unit(axes, unit, rows)
    figure.suptitle(f"{report.bench}, {report.git}")
    figure.savefig(path, dpi=150)


def _draw_unit(axes: Axes, unit: str, rows: list[Row]) -> None:
    at = list(range(len(rows)))
    ours = [row.ours for row in rows]
    # Peers' order statistics may leave the median of few samples at the rim of its interval.
    below = [max(0.0, row.ours - row.interval[0]) for row in rows]
    above = [max(0.0, row.interval[1] - row.ours) for row in rows]
    axes.errorbar(ours, at, xerr=[below, above], fmt="o", capsize=3, label="ours, 95 %")
    for name, marker, values in (
        ("paper", "k^", [row.paper for row in rows]),
        ("peer", "rx", [row.peer.value if row.peer else None for row in rows]),
        ("asked", "g|", [None if row.asked is UNSET else row.asked for row in rows]),
    ):
        known = [(value, y) for value, y in zip(values, at, strict=True) if value is not None]
        if known:
            axes.plot(*zip(*known, strict=True), marker, label=name)
    axes.set_yticks(at, [f"{row.row}, {row.metric}" for row in rows], fontsize=7)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlabel(unit or "error")
    axes.grid(True, axis="x", alpha=0.3)
    axes.legend(fontsize=7)
