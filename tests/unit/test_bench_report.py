"""Rows, intervals and documents of experiments."""

import csv
import json
from pathlib import Path

import msgspec
import numpy as np
import pytest

from schemas.errors import MissingComponentError, UserError
from services.commands import bench
from sim.experiments.bench_figures import draw_rows
from sim.experiments.report import (
    HEAD,
    Outcome,
    Peer,
    Report,
    Row,
    Settings,
    bootstrap_median_interval,
    cells,
    csv_text,
    failure_lines,
    json_text,
    rate_row,
    table_of,
    time_row,
    wilson_interval,
)

ROWS = (
    rate_row("husky", "success", [True] * 9 + [False]),
    time_row("husky", "time", [1.0, 2.0, 3.0], np.random.default_rng(0), paper=35.0),
    Row(
        row="codec",
        metric="decode",
        unit="us",
        better="lower",
        ours=2.0,
        interval=(1.5, 2.5),
        peer=Peer("other 1.0", 4.0),
    ),
)


def report(name: str = "grounding") -> Report:
    return Report(
        bench=name,
        seed=1,
        runs=10,
        git="abc1234",
        machine="2 cores",
        elapsed_s=1.5,
        rows=ROWS,
        failures={"ours": {"timeout": 1, "stopped_early": 3}},
    )


@pytest.mark.parametrize(
    ("successes", "trials", "expected"),
    [(5, 10, (0.2366, 0.7634)), (0, 10, (0.0, 0.2775)), (10, 10, (0.7225, 1.0)), (0, 0, (0, 1))],
)
def test_wilson_interval_is_that_of_the_literature(
    successes: int, trials: int, expected: tuple[float, float]
) -> None:
    assert wilson_interval(successes, trials) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("trials", [1, 2, 7, 80])
def test_a_rate_lies_in_its_interval(trials: int) -> None:
    for successes in range(trials + 1):
        low, high = wilson_interval(successes, trials)
        assert 0.0 <= low <= successes / trials <= high <= 1.0


def test_bootstrap_covers_the_median_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    hits = 0
    for _ in range(100):
        low, high = bootstrap_median_interval(rng.exponential(1.0, 40).tolist(), rng)
        hits += low <= np.log(2.0) <= high
    assert hits >= 86


def test_document_has_the_keys_of_the_contract() -> None:
    document = json.loads(json_text(report()))
    assert list(document) == [
        "bench",
        "seed",
        "runs",
        "git",
        "machine",
        "elapsed_s",
        "rows",
        "failures",
        "comparisons",
        "settings",
    ]
    assert set(document["rows"][0]) == {
        "row",
        "metric",
        "unit",
        "better",
        "paper",
        "ours",
        "interval",
        "arms",
        "peer",
    }
    assert document["rows"][2]["peer"] == {"name": "other 1.0", "value": 4.0}


def test_table_and_csv_say_the_same() -> None:
    assert cells(ROWS[0])[:3] == ("husky, success (%)", "", "90")
    assert cells(ROWS[1])[1] == "35"
    assert cells(ROWS[2])[4] == "other 1.0 4"
    lines = list(csv.DictReader(csv_text(report()).splitlines()))
    assert [float(line["ours"]) for line in lines] == [row.ours for row in ROWS]


def test_commonest_failure_comes_first() -> None:
    assert failure_lines(report()) == ["3 x ours: stopped_early", "1 x ours: timeout"]


def test_every_row_is_drawn(tmp_path: Path) -> None:
    path = tmp_path / "rows.svg"
    draw_rows(report(), path)
    drawn = path.read_text()
    assert all(f"{row.row}, {row.metric}" in drawn for row in ROWS)


def measured(settings: Settings) -> Outcome:
    settings.progress("working")
    return Outcome(ROWS, {"ours": {"timeout": settings.seed}})


@pytest.fixture
def only_bench(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "BENCHES", {"sample": bench.Bench("sample:measure", 7)})
    functions = {"sample:measure": measured, "bench_figures:draw_rows": draw_rows}
    monkeypatch.setattr(bench, "_function", functions.__getitem__)


@pytest.mark.usefixtures("only_bench")
def test_bench_prints_one_document_and_writes_three_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert bench.bench("sample", seed=3, json=True, plot=tmp_path / "out") == 0
    printed = json.loads(capsys.readouterr().out)
    assert (printed["bench"], printed["seed"], printed["runs"]) == ("sample", 3, 7)
    assert printed["failures"] == {"ours": {"timeout": 3}}
    assert json.loads((tmp_path / "out" / "sample.json").read_text()) == printed
    assert (tmp_path / "out" / "sample.csv").read_text() == csv_text(report())
    assert (tmp_path / "out" / "sample.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.usefixtures("only_bench")
def test_all_is_a_document_of_documents(capsys: pytest.CaptureFixture[str]) -> None:
    assert bench.bench("all", runs=2, json=True) == 0
    printed = json.loads(capsys.readouterr().out)
    assert [one["bench"] for one in printed["benches"]] == ["sample"]


@pytest.mark.usefixtures("only_bench")
def test_text_has_rows_and_failures(capsys: pytest.CaptureFixture[str]) -> None:
    assert bench.bench("sample", seed=2) == 0
    printed = capsys.readouterr().out
    assert "95 % interval" in printed
    assert "husky, time (ms)" in printed
    assert "2 x ours: timeout" in printed


def test_errors_name_what_is_allowed() -> None:
    with pytest.raises(UserError, match="grounding_scaling"):
        bench.bench("table99")
    with pytest.raises(UserError, match="--runs 0; allowed: 1"):
        bench.bench("grounding", runs=0)


@pytest.mark.parametrize("name", bench.BENCHES)
def test_help_names_every_bench(name: str) -> None:
    assert name in (bench.bench.__doc__ or "")


def test_without_ray_a_cluster_is_refused_with_the_remedy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(MissingComponentError, match=r"pip install 'ray>=2\.50'"):
        bench.bench("fov", cluster=())


def test_a_cluster_has_one_address() -> None:
    with pytest.raises(UserError, match="--cluster a b; allowed: one address"):
        bench.bench("fov", cluster=("a", "b"))


def test_a_goal_stands_beside_the_figure_and_elsewhere_nothing_changes() -> None:
    goal = msgspec.structs.replace(ROWS[2], asked=1.8)
    assert json.loads(msgspec.json.encode(goal))["asked"] == 1.8
    head, lines = table_of([ROWS[0], goal])
    assert head[-1] == "asked"
    assert [line[-1] for line in lines] == ["", "<= 1.8, missed"]
    assert msgspec.structs.replace(ROWS[0], asked=90.0).asked_text == ">= 90"
    assert table_of(ROWS)[0] == HEAD
