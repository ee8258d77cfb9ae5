"""Episodes in lockstep: the document of the contract, and the same seed gives the same log."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from services.process_table import PROCESSES
from services.runtime.repair import check_log

root = Path(__file__).parents[2]
pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]


def episode(*arguments: str) -> dict[str, Any]:
    """One episode in a process of its own, as a user runs it."""
    command = [sys.executable, "-m", "services.cli", "episode", "--json", *arguments]
    ran = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    assert ran.returncode in (0, 3, 4), ran.stderr
    return json.loads(ran.stdout)


def test_an_episode_succeeds_and_repeats_byte_for_byte(tmp_path: Path) -> None:
    arguments = ("--say", "go to the hydrant behind the cone", "--seed", "6")
    first = episode(*arguments, "--log", str(tmp_path / "a.mcap"))
    again = episode(*arguments)
    assert first["log_sha256"] == again["log_sha256"]
    assert first["success"]
    assert first["stopped"]
    assert first["failure"] is None
    assert first["final_error_m"] <= 2.0
    assert first["distance_m"] >= first["shortest_path_m"] - 0.5
    assert check_log(tmp_path / "a.mcap") == []


def test_what_is_not_understood_moves_nothing() -> None:
    result = episode("--say", "paint the fence")
    assert result["failure"] == "not_understood"
    assert not result["success"]
    assert result["distance_m"] < 0.01


def test_rows_of_the_process_table_are_unique_and_explained() -> None:
    assert len({process.name for process in PROCESSES}) == len(PROCESSES)
    assert all(process.purpose for process in PROCESSES)
