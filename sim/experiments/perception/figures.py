"""The figures of `bench perception`: curves, calibration, errors in space, and a sheet."""

from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim.experiments.perception.box_rows import mean_precision
from sim.experiments.perception.boxes import HALF, BoxFigures
from sim.experiments.perception.found import Found
from sim.experiments.perception.sheet import Drawn, draw_sheet
from sim.experiments.perception.space import BANDS, Placings
from sim.experiments.perception.space_rows import ASKED_CM, ASKED_OF_RANGE
from sim.experiments.report import Report

ON_SHEET = 12
_few = 5
"""Fewer boxes in a bin, or things in a band, say nothing."""
_most_m = 0.6
"""Errors beyond are drawn at the rim [m]."""


def draw(found: Found, report: Report, path: Path) -> None:
    """Four panels, and beside them a sheet of pictures, `..._sheet.png`."""
    figure = Figure(figsize=(12, 9), layout="constrained")
    panels = figure.subplots(2, 2)
    _draw_curves(panels[0, 0], found.faint)
    _draw_classes(panels[0, 1], found.faint)
    _draw_reliability(panels[1, 0], found.faint)
    _draw_errors(panels[1, 1], found.placings)
    pictures = len(found.scenes)
    figure.suptitle(f"{pictures} rendered pictures that nothing was learned from, {report.git}")
    figure.savefig(path, dpi=120)
    draw_sheet(_chosen(found), path.with_name(f"{path.stem}_sheet.png"))


def _draw_curves(axes: Axes, figures: BoxFigures) -> None:
    colors = _colors(len(figures.shown))
    for name, tables, color in zip(figures.shown, figures.tables, colors, strict=True):
        recall, precision = tables[HALF].curve()
        axes.plot(recall, precision, color=color, label=name)
    axes.set(xlabel="recall", ylabel="precision", xlim=(0, 1), ylim=(0, 1.02))
    axes.set_title("Boxes at an overlap of a half")
    axes.grid(True, alpha=0.3)
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _draw_classes(axes: Axes, figures: BoxFigures) -> None:
    at = np.arange(len(figures.shown))
    half = [mean_precision([tables[HALF]]) for tables in figures.tables]
    every = [mean_precision(tables) for tables in figures.tables]
    axes.barh(at - 0.2, half, 0.38, label=f"AP50, mean {np.mean(half):.3f}")
    axes.barh(at + 0.2, every, 0.38, label=f"AP50-95, mean {np.mean(every):.3f}")
    axes.set_yticks(at, figures.shown)
    axes.set_ylim(len(at) - 0.4, -0.6)
    axes.set(xlim=(0, 1), title="Average precision of each class")
    axes.grid(True, axis="x", alpha=0.3)
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.06), ncols=2)


def _draw_reliability(axes: Axes, figures: BoxFigures) -> None:
    table = [row for row in figures.claims.reliability if row.count >= _few]
    said, right = [row.probability for row in table], [row.frequency for row in table]
    axes.plot([0, 1], [0, 1], "k:", label="as it should be")
    axes.plot(said, right, "o-", label=f"ours, error {figures.claims.calibration_error():.3f}")
    for row in table:
        axes.annotate(str(row.count), (row.probability, row.frequency), fontsize=7,
                      xytext=(4, -9), textcoords="offset points")  # fmt: skip
    axes.set(xlabel="probability of the class named", ylabel="share that is right")
    axes.set(xlim=(0, 1), ylim=(0, 1), title="Reliability, with the number of boxes")
    axes.grid(True, alpha=0.3)
    axes.legend(fontsize=8, loc="upper left")


def _draw_errors(axes: Axes, placings: Placings) -> None:
    for kind, color in (("small", "tab:blue"), ("large", "tab:orange")):
        own = placings.selected(
            placings.placed & placings.whole & (placings.small == (kind == "small"))
        )
        shown = np.minimum(own.errors, _most_m)
        axes.plot(own.ranges, 100 * shown, ".", color=color, alpha=0.3, markersize=4)
        label: str | None = f"{kind} things, mean"
        for band in BANDS:
            some = own.errors[own.within(band)]
            if len(some) >= _few:
                axes.plot(band, [100 * some.mean()] * 2, color=color, lw=3, label=label)
                # One line in the legend is enough.
                label = None
    far = BANDS[-1][1]
    axes.plot([0, far], [0, far * ASKED_OF_RANGE], "k:", label=f"asked: {ASKED_OF_RANGE:g} %")
    axes.plot(2.0, ASKED_CM, "k^", label=f"asked: {ASKED_CM:g} cm at 2 m")
    axes.set(xlabel="distance from the camera [m]", ylabel="error of the centre [cm]")
    axes.set(xlim=(0, far), ylim=(0, 100 * _most_m), title="Places in space, network's own boxes")
    axes.grid(True, alpha=0.3)
    axes.legend(fontsize=8, loc="upper left")


def _chosen(found: Found) -> list[Drawn]:
    """Pictures spread over all that show something."""
    showing = [number for number, one in enumerate(found.working) if len(one.true_classes)]
    spread = np.linspace(0, max(len(showing) - 1, 0), min(ON_SHEET, len(showing)))
    return [_drawn(found, showing[round(float(at))]) for at in spread]


def _drawn(found: Found, number: int) -> Drawn:
    color = found.frames[number].frame.color
    return Drawn(color, found.working[number].found, found.faint.classes)


def _colors(count: int) -> list[tuple[float, ...]]:
    return [tuple(colormaps["tab20"](index % 20)) for index in range(count)]
