"""No figure is far worse beside its peer than it was when the baseline was blessed.

Times of a busy machine mean little, so only ratios within one run count here, and each row says
how far its ratio may drift. What is no speed, such as a loss, has a limit of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

import msgspec
import numpy as np
import pytest

from sim import vulkan
from tests.benchmarks import baseline
from tests.benchmarks.__main__ import BENCHMARKS, DRAWING, table
from tests.benchmarks.rows import Peer, Row, quantile, quantile_interval


@dataclass(frozen=True)
class Short:
    """A benchmark with few rounds."""

    name: str
    rounds: int


# All but "shader", whose peer alone takes a quarter of a minute to its first picture, and
# "mapping_growth", which has no peer, hence no baseline.
SHORT = (
    Short("wire", 6),
    Short("codec", 15),
    Short("camera", 11),
    Short("detector", 15),
    Short("fiducials", 3),
    Short("manipulation", 5),
    Short("startup", 1),
    Short("mapping", 3),
    Short("log", 3),
)
MORE_ATTEMPTS = 2


@pytest.fixture(scope="module")
def blessed() -> baseline.Baseline:
    return baseline.load()


@pytest.fixture(scope="module")
def why_nothing_can_be_drawn() -> str:
    vulkan.activate()
    try:
        vulkan.device_name()
    except vulkan.NoVulkanDeviceError as error:
        return str(error)
    return ""


@pytest.mark.bench
@pytest.mark.slow
@pytest.mark.parametrize("short", SHORT, ids=lambda short: short.name)
def test_no_figure_drifted_from_the_baseline(
    short: Short, blessed: baseline.Baseline, why_nothing_can_be_drawn: str
) -> None:
    if short.name in DRAWING and why_nothing_can_be_drawn:
        pytest.skip(why_nothing_can_be_drawn)
    measure: Callable[[int], list[Row]] = import_module(f"tests.benchmarks.{short.name}").measure
    complaints, rows = lasting_complaints(lambda: measure(short.rounds), blessed)
    assert rows
    assert not complaints, "\n".join([*complaints.values(), table(rows, blessed)])


def lasting_complaints(
    measure: Callable[[], list[Row]], blessed: baseline.Baseline
) -> tuple[dict[str, str], list[Row]]:
    """What is wrong every time, by key, and the last rows.

    While others take all cores for a moment, a message waits or is dropped; a worse program is
    worse each time.
    """
    rows = measure()
    lasting = complaints_by_key(rows, blessed)
    for _ in range(MORE_ATTEMPTS):
        if not lasting:
            break
        rows = measure()
        again = complaints_by_key(rows, blessed)
        lasting = {key: text for key, text in again.items() if key in lasting}
    return lasting, rows


def complaints_by_key(rows: list[Row], blessed: baseline.Baseline) -> dict[str, str]:
    return {row.key: text for row in rows if (text := baseline.complaint(row, blessed))}


def row(ours: float, *, peer: float | None = 1.0, better: str = "lower", **more: float) -> Row:
    content = {"row": "a", "metric": "b", "unit": "s", "better": better, "ours": ours, **more}
    beside = None if peer is None else Peer("other 1.2", peer)
    return msgspec.convert(content | {"interval": (ours, ours), "peer": beside}, Row)


def baseline_of(blessed_row: Row) -> baseline.Baseline:
    figure = baseline.Figure(
        unit="s", ours=1.0, peer=None, ratio=blessed_row.ratio, machine="", git=""
    )
    return {blessed_row.key: figure}


def test_every_benchmark_is_tested_or_said_why_not():
    assert {short.name for short in SHORT} == BENCHMARKS.keys() - {"shader", "mapping_growth"}


@pytest.mark.parametrize(("better", "worse"), [("lower", 3.0), ("higher", 1 / 3)])
def test_drift_has_the_direction_of_the_metric(better: str, worse: float):
    before = baseline_of(row(1.0, better=better))
    assert baseline.complaint(row(worse, better=better, drift=3.1), before) is None
    assert baseline.complaint(row(1 / worse, better=better, drift=2.0), before) is None
    complaint = baseline.complaint(row(worse, better=better, drift=2.0), before)
    assert complaint is not None
    assert "3.0 times worse" in complaint


def test_a_slower_machine_drifts_nowhere():
    before = baseline_of(row(1.0))
    assert baseline.complaint(row(50.0, peer=50.0, drift=1.1), before) is None


def test_a_limit_holds_whatever_the_baseline_says():
    lossy = row(0.5, peer=None, limit=0.0)
    complaint = baseline.complaint(lossy, baseline_of(lossy))
    assert complaint is not None
    assert "allowed is 0" in complaint


def test_a_row_without_a_baseline_is_a_complaint():
    complaint = baseline.complaint(row(1.0), {})
    assert complaint is not None
    assert "--bless" in complaint


def test_what_is_wrong_once_is_forgiven_and_what_is_wrong_each_time_is_not():
    before = baseline_of(row(1.0))
    good, bad = [row(1.0, drift=2.0)], [row(9.0, drift=2.0)]
    recovering, worse = iter([bad, bad, good]), iter([bad] * 3)
    assert not lasting_complaints(lambda: next(recovering), before)[0]
    assert lasting_complaints(lambda: next(worse), before)[0].keys() == before.keys()


def test_the_version_of_a_peer_is_no_part_of_the_key():
    assert row(1.0).key == "a, b, beside other"


@pytest.mark.parametrize("q", [0.5, 0.99])
def test_intervals_hold_the_true_quantile_in_nineteen_of_twenty_cases(q: float):
    rng = np.random.default_rng(0)
    drawn = rng.uniform(size=(400, 500))
    intervals = [quantile_interval(samples, q) for samples in drawn]
    assert np.mean([low <= q <= high for low, high in intervals]) >= 0.92
    assert all(
        low <= quantile(samples, q) <= high
        for samples, (low, high) in zip(drawn, intervals, strict=True)
    )
