"""Table 2 stands beside the paper's, and every run counts."""

import msgspec
import numpy as np
import pytest

from schemas.task import Failure
from sim.experiments.montecarlo_job import Result
from sim.experiments.report import Report
from sim.experiments.table2 import SCENARIOS, TITLES, draw, rows_of

GOOD = Result(
    scenario=SCENARIOS[0].name, arm="ours", seed=0, success=True, at_class=True, failure=None,
    distance_m=14.0, shortest_m=12.6, time_s=25.0, decisions=9, log_sha256="",
)  # fmt: skip
LOST = msgspec.structs.replace(
    GOOD, seed=1, success=False, failure=Failure.NEVER_FOUND, distance_m=30.0, time_s=75.0
)
AGAIN = msgspec.structs.replace(GOOD, seed=1)


def results():
    return [
        msgspec.structs.replace(one, arm=arm, scenario=scenario.name)
        for scenario in SCENARIOS
        for arm in TITLES
        for one in (GOOD, LOST if arm == "ours" else AGAIN)
    ]


def found():
    rng = np.random.default_rng(0)
    rows = [row for scenario in SCENARIOS for row in rows_of(scenario, results(), rng)]
    return {(row.row, row.metric): row for row in rows}, rows


def test_failures_count_in_every_figure():
    table, _ = found()
    assert table["office, ours", "distance"].ours == pytest.approx(22.0)
    assert table["office, ours", "distance, standard deviation"].ours == pytest.approx(8.0)
    assert table["office, ours", "success"].ours == 50.0
    assert table["office, ours", "SPL"].ours == pytest.approx(0.5 * 12.6 / 14.0)


def test_the_papers_figures_stand_beside_the_first_floor_alone():
    table, rows = found()
    assert table["office, known map", "distance"].paper == 12.88
    assert table["office, without language", "time"].paper == 85.57
    assert table["office, ours", "distance, standard deviation"].paper == 6.84
    assert {row.row.partition(",")[0] for row in rows if row.paper is not None} == {"office"}
    assert all(row.paper is None for row in rows if "wrong hall" in row.row)


def test_ours_is_told_as_a_multiple_of_the_known_maps():
    table, _ = found()
    distance = table["office, ours", "distance by the known map's"]
    assert distance.ours == pytest.approx(22.0 / 14.0)
    assert distance.paper == pytest.approx(16.64 / 12.88)
    assert distance.interval[0] <= distance.ours <= distance.interval[1]


def test_the_figure_can_be_drawn(tmp_path):
    _, rows = found()
    report = Report(
        bench="table2", seed=0, runs=2, git="", machine="", elapsed_s=0.0, rows=tuple(rows),
        failures={}, settings=("as in the test",),
    )  # fmt: skip
    draw(report, tmp_path / "table2.png")
    assert (tmp_path / "table2.png").stat().st_size > 10_000
