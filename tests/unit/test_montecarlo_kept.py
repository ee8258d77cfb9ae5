"""An experiment that was interrupted goes on where it was, and never with results of other code."""

from pathlib import Path

import pytest

from schemas.errors import UserError
from sim.experiments import kept
from sim.experiments.kept import Kept
from sim.experiments.montecarlo_job import Job, Result
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.table1 import ROWS


def job(seed: int) -> Job:
    return Job(ROWS[0].scenario, "ours", seed, PerceptionSettings())


def result(seed: int) -> Result:
    return Result(
        scenario=ROWS[0].scenario.name,
        arm="ours",
        seed=seed,
        success=True,
        at_class=True,
        failure=None,
        distance_m=12.0 + seed,
        shortest_m=9.0,
        time_s=20.0,
        decisions=7,
        log_sha256="0" * 64,
    )


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(kept, "git_revision", lambda: "abc1234")
    return tmp_path / "folder" / "kept.jsonl"


def test_what_was_kept_is_found_again_and_nothing_else(path: Path):
    first = Kept(path)
    for seed in (1, 2):
        first.add(job(seed), result(seed))
    again = Kept(path)
    assert [again.result_of(job(seed)) for seed in (1, 2, 3)] == [result(1), result(2), None]
    other = Job(ROWS[0].scenario, "frontier", 1, PerceptionSettings())
    assert again.result_of(other) is None


def test_results_of_other_code_are_not_taken(path: Path, monkeypatch: pytest.MonkeyPatch):
    Kept(path).add(job(1), result(1))
    monkeypatch.setattr(kept, "git_revision", lambda: "def5678")
    assert Kept(path).result_of(job(1)) is None


@pytest.mark.parametrize("revision", ["abc1234+", "unknown"])
def test_a_changed_checkout_keeps_nothing(
    path: Path, revision: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(kept, "git_revision", lambda: revision)
    with pytest.raises(UserError, match="commit"):
        Kept(path)


def test_a_line_that_was_cut_off_is_skipped(path: Path):
    first = Kept(path)
    for seed in (1, 2):
        first.add(job(seed), result(seed))
    path.write_bytes(path.read_bytes()[:-25])
    again = Kept(path)
    assert again.result_of(job(1)) == result(1)
    assert again.result_of(job(2)) is None
    again.add(job(2), result(2))
    assert [Kept(path).result_of(job(seed)) for seed in (1, 2)] == [result(1), result(2)]
