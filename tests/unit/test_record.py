"""Laws of the log: what was written is read, also after the writer was killed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from schemas import topics
from schemas.codec import encode
from schemas.health import Tick
from services.runtime.log_file import LogError, log_summary, read_log
from services.runtime.mailbox import Sample
from services.runtime.message_schemas import json_schema
from services.runtime.record import LogWriter
from services.runtime.repair import check_log, recover

endless_writer = """
import sys, time
from pathlib import Path
from schemas import topics
from schemas.codec import encode
from schemas.health import Tick
from services.runtime.mailbox import Sample
from services.runtime.record import LogWriter
writer = LogWriter(Path(sys.argv[1]), {})
number = 0
while True:
    now = time.time_ns()
    writer.write(Sample(topics.TICK, encode(Tick(stamp_ns=now)), 1, number, now), now)
    number += 1
    print(number, now, flush=True)
    time.sleep(0.005)
"""


def write_ticks(path: Path, sequences: list[int]) -> list[bytes]:
    writer = LogWriter(path, {"run": {"seed": "7"}})
    payloads = [encode(Tick(stamp_ns=sequence)) for sequence in sequences]
    for sequence, payload in zip(sequences, payloads, strict=True):
        writer.write(Sample(topics.TICK, payload, 1, sequence, sequence), log_ns=sequence)
    writer.close()
    return payloads


def test_reading_gives_back_what_was_written_in_order(tmp_path: Path) -> None:
    payloads = write_ticks(tmp_path / "a.mcap", list(range(50)))
    records = list(read_log(tmp_path / "a.mcap"))
    assert [record.data for record in records] == payloads
    assert log_summary(tmp_path / "a.mcap")["metadata"]["run"] == {"seed": "7"}
    assert check_log(tmp_path / "a.mcap") == []


def test_check_counts_what_is_missing(tmp_path: Path) -> None:
    write_ticks(tmp_path / "a.mcap", [0, 1, 5, 6])
    assert check_log(tmp_path / "a.mcap") == ["tick: 3 messages missing"]


def test_a_killed_writer_loses_at_most_half_a_second(tmp_path: Path) -> None:
    path, mended = tmp_path / "a.mcap", tmp_path / "b.mcap"
    child = subprocess.Popen(
        [sys.executable, "-c", endless_writer, str(path)], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    lines: list[str] = []
    started = time.monotonic()
    while time.monotonic() - started < 2.0:
        lines.append(child.stdout.readline())
    os.kill(child.pid, signal.SIGKILL)
    lines += child.stdout.read().splitlines()
    child.wait()
    with pytest.raises(LogError, match="recover"):
        list(read_log(path))
    recovered = recover(path, mended)
    last_written_ns = int(lines[-1].split()[1])
    last_kept_ns = list(read_log(mended))[-1].log_ns
    assert recovered > 0
    assert last_written_ns - last_kept_ns < 0.5e9


def test_files_that_are_no_logs_are_refused(tmp_path: Path) -> None:
    (tmp_path / "no.mcap").write_bytes(b"hello")
    with pytest.raises(LogError, match=r"no\.mcap"):
        list(read_log(tmp_path / "no.mcap"))
    with pytest.raises(LogError, match="no such file"):
        list(read_log(tmp_path / "none.mcap"))


@pytest.mark.parametrize("topic", topics.ALL_TOPICS, ids=lambda topic: topic.key)
def test_every_message_has_a_schema_of_an_object(topic: topics.Topic) -> None:
    schema = json_schema(topic.type)
    assert schema["type"] == "object"
    assert "stamp_ns" in schema["properties"]


def test_the_settings_of_a_run_come_back_from_its_log(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    files = (str(Path(__file__)), str(Path(__file__).with_name("test_cli.py")))
    run = RunConfig(seed=7, detectors=files, adaptive=False, tags="tags.json")
    LogWriter(path, run_metadata(run)).close()
    assert recorded_run(path) == run
