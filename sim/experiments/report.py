"""What an experiment says: rows beside the paper's, intervals, failures by cause."""

import csv
import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
from msgspec import UNSET, Struct, UnsetType
from numpy.random import Generator
from numpy.typing import NDArray

Interval = tuple[float, float]
Better = Literal["lower", "higher"]
Asked = float | UnsetType
"""A goal, where one was set."""

RESAMPLES = 2000
_z = 1.959964
"""97.5 % quantile of the standard normal distribution."""


class Peer(Struct, frozen=True):
    """What ours is measured beside, in the same run."""

    name: str
    value: float


class Row(Struct, frozen=True, kw_only=True):
    """One figure with a direction."""

    row: str
    """What was measured."""
    metric: str
    unit: str
    better: Better
    paper: float | None = None
    ours: float
    interval: Interval
    """95 % of `ours`."""
    arms: dict[str, float] = {}
    """The same figure of other ways to do it."""
    peer: Peer | None = None
    asked: Asked = UNSET
    """What was set as a goal, where one was; the document leaves it out elsewhere."""

    @property
    def asked_text(self) -> str:
        """The goal for people, and whether it is missed."""
        if self.asked is UNSET:
            return ""
        lower = self.better == "lower"
        missed = self.ours > self.asked if lower else self.ours < self.asked
        return f"{'<=' if lower else '>='} {self.asked:.4g}{', missed' if missed else ''}"

    @property
    def title(self) -> str:
        """Row, metric and unit, for people."""
        return f"{self.row}, {self.metric}" + (f" ({self.unit})" if self.unit else "")


class Comparison(Struct, frozen=True, kw_only=True):
    """Ours beside another arm in the same worlds."""

    row: str
    metric: str
    unit: str
    better: Better
    arm: str
    worlds: int
    """Number of worlds that both met."""
    ours: float
    theirs: float
    difference: float
    """Mean of ours less theirs, world by world."""
    interval: Interval
    """95 % of `difference`."""

    @property
    def verdict(self) -> str:
        """Whether ours is better beyond chance."""
        low, high = self.interval if self.better == "higher" else [-x for x in self.interval[::-1]]
        return "better" if low > 0 else "worse" if high < 0 else "level"


Failures = dict[str, dict[str, int]]
"""How often, by what was tried and by cause."""


@dataclass(frozen=True)
class Settings:
    """How an experiment is to be run."""

    runs: int
    workers: int
    """Processes that may work at once; what measures time uses one."""
    seed: int
    progress: Callable[[str], None]
    """Told what is being done."""
    cluster: str | None = None
    """Address of a Ray cluster that episodes are spread over, "" to start one; None is none."""
    keep: Path | None = None
    """File of the episodes' results, see `kept`; None keeps none."""
    detectors: tuple[str, ...] = ()
    """ONNX files of the networks that perception is measured with; none is our own."""
    detector_classes: tuple[str, ...] = ()
    """A file with the class names of each, or none."""
    images: Path | None = None
    """Folder of a person's own pictures to try perception on instead of rendered ones."""


@dataclass(frozen=True)
class Outcome:
    """What an experiment found."""

    rows: tuple[Row, ...]
    failures: Failures = field(default_factory=dict[str, dict[str, int]])
    comparisons: tuple[Comparison, ...] = ()
    settings: tuple[str, ...] = ()
    """What the figures hold for, one line each."""
    draw: "Callable[[Report, Path], None] | None" = None
    """Draws what the rows alone do not hold, instead of what else the experiment draws."""


class Report(Struct, frozen=True, kw_only=True):
    """One experiment, as `bench --json` prints it."""

    bench: str
    seed: int
    runs: int
    git: str
    machine: str
    elapsed_s: float
    rows: tuple[Row, ...]
    failures: Failures
    comparisons: tuple[Comparison, ...] = ()
    settings: tuple[str, ...] = ()


def wilson_interval(successes: int, trials: int) -> Interval:
    """95 % score interval of a rate; [0, 1] without trials (Wilson, 1927)."""
    if not trials:
        return 0.0, 1.0
    rate, square = successes / trials, _z * _z
    centre = (rate + square / (2 * trials)) / (1 + square / trials)
    spread = math.sqrt(rate * (1 - rate) / trials + square / (4 * trials * trials))
    half = _z * spread / (1 + square / trials)
    # At a rate of 0 or 1 the end of the interval is that rate, which rounding may miss.
    low, high = min(centre - half, rate), max(centre + half, rate)
    return max(0.0, low), min(1.0, high)


def bootstrap_median_interval(samples: Sequence[float], rng: Generator) -> Interval:
    """95 % percentile interval of the median, by resampling with replacement (Efron, 1979)."""
    values: NDArray[np.float64] = np.asarray(samples, dtype=np.float64)
    drawn = values[rng.integers(0, len(values), (RESAMPLES, len(values)))]
    low, high = np.quantile(np.median(drawn, axis=1), [0.025, 0.975])
    return float(low), float(high)


def rate_row(row: str, metric: str, outcomes: Sequence[bool], asked: Asked = UNSET) -> Row:
    """Share of successes in percent with its Wilson interval."""
    low, high = wilson_interval(sum(outcomes), len(outcomes))
    share = sum(outcomes) / max(len(outcomes), 1)
    return Row(
        row=row,
        metric=metric,
        unit="%",
        better="higher",
        ours=100 * share,
        interval=(100 * low, 100 * high),
        asked=asked,
    )


def time_row(
    row: str,
    metric: str,
    samples_ms: Sequence[float],
    rng: Generator,
    paper: float | None = None,
    peer: Peer | None = None,
) -> Row:
    """Median of times [ms] with its bootstrap interval."""
    return Row(
        row=row,
        metric=metric,
        unit="ms",
        better="lower",
        paper=paper,
        ours=float(np.median(samples_ms)),
        interval=bootstrap_median_interval(samples_ms, rng),
        peer=peer,
    )


HEAD = ("metric", "paper", "ours", "95 % interval", "peer")


def table_of(rows: Sequence[Row]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Head and cells; where goals were set, they stand in a column of their own."""
    if all(row.asked is UNSET for row in rows):
        return HEAD, [cells(row) for row in rows]
    return (*HEAD, "asked"), [(*cells(row), row.asked_text) for row in rows]


def cells(row: Row) -> tuple[str, ...]:
    """One row under `HEAD`, for people."""
    arms = "".join(f"\n{name} {value:.3g}" for name, value in row.arms.items())
    return (
        row.title,
        "" if row.paper is None else f"{row.paper:.4g}",
        f"{row.ours:.3g}{arms}",
        f"{row.interval[0]:.3g} .. {row.interval[1]:.3g}",
        f"{row.peer.name} {row.peer.value:.3g}" if row.peer else "",
    )


COMPARISON_HEAD = ("in the same worlds", "ours", "other arm", "difference", "95 % interval", "")


def comparison_cells(one: Comparison) -> tuple[str, ...]:
    """One comparison under `COMPARISON_HEAD`, for people."""
    unit = f" ({one.unit})" if one.unit else ""
    return (
        f"{one.row}, {one.metric}{unit}, {one.worlds} worlds",
        f"{one.ours:.3g}",
        f"{one.arm} {one.theirs:.3g}",
        f"{one.difference:+.3g}",
        f"{one.interval[0]:+.3g} .. {one.interval[1]:+.3g}",
        one.verdict,
    )


def failure_lines(report: Report) -> list[str]:
    """Failures by cause, the commonest first."""
    return [
        f"{count} x {tried}: {cause}"
        for tried, causes in report.failures.items()
        for cause, count in sorted(causes.items(), key=lambda item: (-item[1], item[0]))
    ]


def csv_text(report: Report) -> str:
    """The rows as comma-separated values, numbers in full, one column for each other arm."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    arms = list(dict.fromkeys(name for row in report.rows for name in row.arms))
    head = ("row", "metric", "unit", "paper", "ours", "low", "high", "peer", "peer value", "asked")
    writer.writerow((*head, *arms))
    for row in report.rows:
        peer = (row.peer.name, row.peer.value) if row.peer else ("", "")
        paper = "" if row.paper is None else row.paper
        others = [row.arms.get(name, "") for name in arms]
        asked = "" if row.asked is UNSET else row.asked
        figures = (row.ours, *row.interval, *peer, asked, *others)
        writer.writerow((row.row, row.metric, row.unit, paper, *figures))
    return out.getvalue()


def json_text(report: Report) -> str:
    """The document of the contract."""
    return msgspec.json.format(msgspec.json.encode(report), indent=1).decode() + "\n"
