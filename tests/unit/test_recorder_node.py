"""The recorder goes on whatever becomes of its disk."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from schemas import topics
from schemas.codec import encode
from schemas.health import Fault, Tick
from schemas.run import RunConfig
from schemas.topics import Output
from services.recorder import node as recorder
from services.recorder.node import RecorderNode
from services.runtime import record
from services.runtime.log_file import read_log
from services.runtime.mailbox import Sample


@pytest.fixture
def room(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """How much is left on the disk, as everybody sees it; retries come at once."""
    left = {"bytes": 10**10}
    for module in (record, recorder):
        monkeypatch.setattr(module, "free_bytes", lambda folder: left["bytes"])
    monkeypatch.setattr(record, "FLUSH_S", 0.0)
    monkeypatch.setattr(recorder, "_retry_s", 1e-6)
    return left


def built(path: Path) -> RecorderNode:
    return RecorderNode(RunConfig(log=str(path)), np.random.default_rng(0))


def tick(number: int) -> Sample:
    return Sample(topics.TICK, encode(Tick(stamp_ns=number)), 1, number, 0)


def faults(outputs: Iterable[Output]) -> list[Fault]:
    assert all(output.topic is topics.FAULT for output in outputs)
    return [output.message for output in outputs if isinstance(output.message, Fault)]


def numbers(path: Path) -> list[int]:
    return [one.sequence for one in read_log(path)]


def test_a_full_disk_is_said_once_and_the_recording_goes_on_when_there_is_room(
    tmp_path: Path, room: dict[str, int]
):
    node = built(tmp_path / "run.mcap")
    assert faults(node.on_sample(tick(0))) == []
    room["bytes"] = 1000
    (fault,) = faults(node.on_sample(tick(1)))
    assert (fault.node, fault.what) == ("recorder", "recording stopped")
    assert "run.mcap" in fault.detail
    assert faults(node.on_sample(tick(2))) == faults(node.on_idle()) == []
    assert numbers(tmp_path / "run.mcap") == [0, 1]
    room["bytes"] = 10**10
    assert faults(node.on_idle()) == []
    node.on_sample(tick(3))
    node.close()
    assert numbers(tmp_path / "run-2.mcap") == [3]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run-2.mcap", "run.mcap"]


def test_a_disk_that_is_full_at_the_start_stops_nobody(tmp_path: Path, room: dict[str, int]):
    room["bytes"] = 1000
    node = built(tmp_path / "run.mcap")
    (fault,) = faults(node.on_sample(tick(0)))
    assert "must stay free" in fault.detail
    node.close()
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_said(tmp_path: Path, room: dict[str, int]):
    (tmp_path / "file").write_text("in the way")
    node = built(tmp_path / "file" / "run.mcap")
    (fault,) = faults(node.on_idle())
    assert "cannot be written" in fault.detail
    assert faults(node.on_sample(tick(0))) == []


def test_a_restarted_recorder_leaves_the_first_file_alone(tmp_path: Path):
    for number in range(3):
        node = built(tmp_path / "run.mcap")
        node.on_sample(tick(number))
        node.close()
    assert [numbers(path) for path in sorted(tmp_path.iterdir())] == [[1], [2], [0]]
