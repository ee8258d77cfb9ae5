"""Results of many runs: every run counts, and arms stand beside ours."""

import math

import msgspec
import numpy as np
import pytest

from schemas.task import Failure
from sim.experiments.arms import BASELINES, Arm
from sim.experiments.fov import RANGES_M, RELATIONS, seen_to
from sim.experiments.montecarlo import (
    failures_of,
    jobs_of,
    mean_row,
    run_job,
    run_jobs,
    success_row,
)
from sim.experiments.montecarlo_job import Job, Result, Scenario
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.report import Settings
from sim.experiments.spread import LOCAL
from sim.experiments.table1 import ROWS, rows_of, runs_of

SCENARIO = Scenario(
    name="behind", world="one_hydrant_one_cone", text=RELATIONS["behind"].text, view_range_m=10.0
)
GOOD = Result(
    scenario="behind", arm="ours", seed=0, success=True, at_class=True, failure=None,
    distance_m=10.0, shortest_m=8.0, time_s=20.0, decisions=4, log_sha256="",
)  # fmt: skip
LOST = msgspec.structs.replace(
    GOOD, seed=1, success=False, at_class=False, failure=Failure.NEVER_FOUND, distance_m=90.0
)


def test_the_rows_are_those_of_the_papers_table() -> None:
    assert len(ROWS) == 7
    assert ROWS[5].scenario.name == "2 hydrants 1 cone, 3.0 m, behind"
    assert [row.known_m for row in ROWS] == [8.75, 8.75, 11.18, 11.18, 10.49, 10.38, 9.19]
    assert all(row.scenario.view_fov_rad == 2 * math.pi for row in ROWS)


def test_all_arms_meet_the_same_worlds() -> None:
    jobs = jobs_of(SCENARIO, runs_of(200, BASELINES), 100, PerceptionSettings())
    seeds = {arm: {job.seed for job in jobs if job.arm == arm} for arm in ("ours", *BASELINES)}
    assert seeds["ours"] == set(range(100, 300))
    assert all(seeds[arm] == set(range(100, 120)) for arm in BASELINES)


def test_every_run_counts_failures_included() -> None:
    rng = np.random.default_rng(0)
    other = msgspec.structs.replace(LOST, arm="frontier")
    results = [GOOD, LOST, other]
    success = success_row("behind", results, paper=98.3)
    distance = mean_row("behind", "distance", "m", results, lambda one: one.distance_m, rng)
    assert (success.ours, success.paper, success.arms) == (50.0, 98.3, {"frontier": 0.0})
    assert success.interval[0] < 50.0 < success.interval[1]
    assert (distance.ours, distance.arms) == (50.0, {"frontier": 90.0})
    assert distance.interval[0] <= 50.0 <= distance.interval[1]
    assert failures_of(results) == {"ours": {"never_found": 1}, "frontier": {"never_found": 1}}


def test_path_efficiency_is_success_weighted_by_length() -> None:
    assert GOOD.path_efficiency == pytest.approx(0.8)
    assert LOST.path_efficiency == 0.0
    assert msgspec.structs.replace(GOOD, distance_m=7.9).path_efficiency == 1.0


def test_rows_with_two_hydrants_say_both_kinds_of_success() -> None:
    wrong = msgspec.structs.replace(
        LOST, failure=Failure.WRONG_OBJECT, at_class=True, scenario=ROWS[4].scenario.name
    )
    metrics = {row.metric: row.ours for row in rows_of(ROWS[4], [wrong], np.random.default_rng(0))}
    assert metrics["success"] == 0.0
    assert metrics["success, any of the class"] == 100.0


def test_fields_of_view_differ_in_range_alone() -> None:
    reached = [seen_to(SCENARIO, reach) for reach in RANGES_M]
    assert [one.view_range_m for one in reached] == list(RANGES_M)
    assert {one.world for one in reached} == {SCENARIO.world}


def settings(workers: int, cluster: str | None = None) -> Settings:
    return Settings(runs=1, workers=workers, seed=0, progress=lambda text: None, cluster=cluster)


def results_of(jobs: list[Job], settings: Settings) -> list[Result]:
    return run_jobs(jobs, settings, lambda done, total, result: None)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_results_do_not_depend_on_the_number_of_workers() -> None:
    jobs = [Job(SCENARIO, arm, 0, PerceptionSettings(), 20) for arm in ("ours", *BASELINES)]
    alone = results_of(jobs, settings(workers=1))
    assert alone == results_of(jobs, settings(workers=2))
    assert [one.arm for one in alone] == [job.arm for job in jobs]
    assert all(one.success for one in alone if one.arm == "known")


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_cluster_gives_the_same_results() -> None:
    pytest.importorskip("ray", reason="the extra `cluster` is not installed")
    arms: tuple[Arm, ...] = ("ours", "known", "pomcp")
    jobs = [Job(SCENARIO, arm, 1, PerceptionSettings(), 20) for arm in arms]
    assert results_of(jobs, settings(1, LOCAL)) == results_of(jobs, settings(1))


@pytest.mark.slow
def test_the_known_map_is_driven_almost_straight() -> None:
    result = run_job(Job(SCENARIO, "known", 3, PerceptionSettings()))
    assert result.success
    assert result.distance_m < result.shortest_m + 1.0
