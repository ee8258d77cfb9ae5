import sys
from pathlib import Path

import pytest

from services import testing
from services.testing import Step

PASSES = Step("passes", (Path(sys.executable).name, "-c", "pass"))
FAILS = Step("fails", (Path(sys.executable).name, "-c", "raise SystemExit(3)"))


@pytest.fixture(autouse=True)
def stamp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "stamp"
    monkeypatch.setattr(testing, "_STAMP", path)
    monkeypatch.setattr(testing, "_install", lambda: 0)
    return path


def test_every_step_runs_and_those_that_failed_are_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(testing, "STEPS", (FAILS, PASSES, FAILS._replace(name="too")))
    assert testing.run_tests() == 1
    assert capsys.readouterr().err.splitlines()[-1].endswith("failed: fails, too")


def test_all_passed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(testing, "STEPS", (PASSES,))
    assert testing.run_tests() == 0


def test_arguments_go_to_pytest_alone(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    echo = Step("pytest", (PASSES.command[0], "-c", "import sys; print(sys.argv[1:])"))
    monkeypatch.setattr(testing, "PYTEST", echo)
    monkeypatch.setattr(testing, "STEPS", (FAILS,))
    assert testing.run_tests(["-k", "one two"]) == 0
    assert capfd.readouterr().out == "['-k', 'one two']\n"


def test_packages_are_installed_once_per_lock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lock = tmp_path / "requirements-test.lock"
    lock.write_text("one")
    calls: list[str] = []

    def install() -> int:
        calls.append(lock.read_text())
        return 0

    monkeypatch.setattr(testing, "_LOCK", lock)
    monkeypatch.setattr(testing, "_install", install)
    monkeypatch.setattr(testing, "STEPS", (PASSES,))
    testing.run_tests()
    testing.run_tests()
    lock.write_text("two")
    testing.run_tests()
    assert calls == ["one", "two"]


def test_a_failed_installation_is_tried_again(monkeypatch: pytest.MonkeyPatch, stamp: Path) -> None:
    monkeypatch.setattr(testing, "_install", lambda: 1)
    assert testing.run_tests() == 5
    assert not stamp.exists()
