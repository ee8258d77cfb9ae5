"""Laws of the log: what was written is read, also after the writer was killed."""

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.records import Footer, Message
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from schemas import topics
from schemas.codec import encode
from schemas.health import Tick
from schemas.run import RunConfig
from services.runtime import record
from services.runtime.log_file import LogError, log_summary, read_log
from services.runtime.log_index import IndexedReader
from services.runtime.mailbox import Sample
from services.runtime.message_schemas import json_schema
from services.runtime.provenance import run_metadata
from services.runtime.record import LogFullError, LogWriter
from services.runtime.repair import check_log, recover
from services.runtime.replay import recorded_run

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
    assert [one.data for one in records] == payloads
    assert log_summary(tmp_path / "a.mcap")["metadata"]["run"] == {"seed": "7"}
    assert check_log(tmp_path / "a.mcap") == []


def test_times_of_a_topic_have_one_order_whoever_sends(tmp_path: Path) -> None:
    """Clocks differ between machines; viewers sort by either time."""
    writer = LogWriter(tmp_path / "a.mcap", {})
    for log_ns, sent_ns in enumerate([5, 12, 3, 14, 2_000], start=10):
        tick = encode(Tick(stamp_ns=sent_ns))
        writer.write(Sample(topics.TICK, tick, sent_ns, 0, sent_ns), log_ns)
    writer.close()
    with (tmp_path / "a.mcap").open("rb") as stream:
        times = [m.publish_time for _, _, m in make_reader(stream).iter_messages()]
    assert times == [5, 11, 11, 13, 14]


def test_check_counts_what_is_missing(tmp_path: Path) -> None:
    write_ticks(tmp_path / "a.mcap", [0, 1, 5, 6])
    assert check_log(tmp_path / "a.mcap") == ["tick: 3 messages missing"]


def test_a_killed_writer_loses_at_most_half_a_second(tmp_path: Path) -> None:
    path, mended = tmp_path / "a.mcap", tmp_path / "b.mcap"
    child = subprocess.Popen(
        [sys.executable, "-c", endless_writer, str(path)], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    lines = [child.stdout.readline()]
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


def write_foreign(path: Path) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="other 1.0")
        channel = writer.register_channel("/chatter", "cdr", 0)
        writer.add_message(channel, 1, b"hello", 1)
        writer.finish()


def test_a_log_of_another_program_is_refused_and_can_be_mended_all_the_same(tmp_path: Path) -> None:
    write_foreign(tmp_path / "ros.mcap")
    for read in (lambda path: list(read_log(path)), log_summary, check_log, recorded_run):
        with pytest.raises(LogError, match=r"profile 'ros2', written by 'other 1\.0'"):
            read(tmp_path / "ros.mcap")
    assert recover(tmp_path / "ros.mcap", tmp_path / "mended.mcap") == 1
    with (tmp_path / "mended.mcap").open("rb") as stream:
        ((_, channel, message),) = make_reader(stream).iter_messages()
    assert (channel.topic, message.data) == ("/chatter", b"hello")


def test_the_index_is_read_as_the_package_reads_it(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    writer = LogWriter(path, {"run": {"seed": "7"}})
    for number in range(40):
        for topic in (topics.TICK, topics.ODOMETRY)[: 1 + number % 2]:
            writer.write(Sample(topic, encode(Tick(stamp_ns=number)), 1, number, number), number)
        writer.flush()
    writer.close()
    with path.open("rb") as ours, path.open("rb") as theirs:
        given = IndexedReader(ours, by_topic=True).get_summary()
        wanted = make_reader(theirs).get_summary()
    assert given is not None
    assert len(given.chunk_indexes) == 40
    assert vars(given) == vars(wanted)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.999])
def test_a_file_that_is_cut_short_says_so_and_is_mended(tmp_path: Path, share: float) -> None:
    path, mended = tmp_path / "a.mcap", tmp_path / "b.mcap"
    writer = LogWriter(path, {"run": {"seed": "7"}})
    payloads = noise(60)
    for number, payload in enumerate(payloads):
        writer.write(Sample(topics.TICK, payload, 1, number, number), number)
    writer.close()
    path.write_bytes(path.read_bytes()[: round(share * path.stat().st_size)])
    with pytest.raises(LogError, match=r"not complete .* 'incognita log recover"):
        list(read_log(path))
    if share == 0.1:
        with pytest.raises(LogError, match="nothing could be recovered"):
            recover(path, mended)
        assert not mended.exists()
        return
    count = recover(path, mended)
    assert [one.data for one in read_log(mended)] == payloads[:count]
    assert count >= (share - 0.25) * len(payloads)


def test_a_file_with_damage_in_its_middle_is_mended_up_to_there(tmp_path: Path) -> None:
    path, mended = tmp_path / "a.mcap", tmp_path / "b.mcap"
    writer = LogWriter(path, {})
    payloads = noise(60)
    for number, payload in enumerate(payloads):
        writer.write(Sample(topics.TICK, payload, 1, number, number), number)
    writer.close()
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(LogError, match=r"damaged .* 'incognita log recover"):
        check_log(path)
    count = recover(path, mended)
    assert 0 < count < 60
    assert [one.data for one in read_log(mended)] == payloads[:count]


def write_all(writer: LogWriter, samples: list[Sample]) -> None:
    for sample in samples:
        writer.write(sample, sample.sent_ns)


def noise(count: int) -> list[bytes]:
    """Payloads of 64 kB that do not get smaller."""
    return [os.urandom(64_000) for _ in range(count)]


def test_a_file_ends_with_its_index_before_the_disk_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.mcap"
    writer = LogWriter(path, {})
    for number in range(10):
        writer.write(Sample(topics.TICK, encode(Tick(stamp_ns=number)), 1, number, number), number)
    monkeypatch.setattr(record, "free_bytes", lambda folder: record.RESERVE_BYTES - 1)
    with pytest.raises(LogFullError, match="64 MB must stay free"):
        writer.flush()
    writer.close()
    assert len(list(read_log(path))) == 10
    with pytest.raises(LogFullError):
        LogWriter(tmp_path / "b.mcap", {})
    assert not (tmp_path / "b.mcap").exists()


@pytest.fixture
def no_file_above() -> Iterator[Callable[[int], None]]:
    """Limits the size of files, which fails as a full disk does: in the middle of a write."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("size", [200_000, 1_500_000, 3_000_123])
def test_a_write_that_fails_in_the_middle_leaves_a_whole_file(
    tmp_path: Path, size: int, no_file_above: Callable[[int], None]
) -> None:
    path, payloads = tmp_path / "a.mcap", noise(100)
    writer = LogWriter(path, {})
    no_file_above(size)
    samples = [Sample(topics.TICK, payload, 1, n, n) for n, payload in enumerate(payloads)]
    with pytest.raises(LogFullError, match="File too large"):
        write_all(writer, samples)
    writer.close()
    assert path.stat().st_size <= size
    # Magic numbers, checksums and the footer at the end are checked, too.
    with path.open("rb") as stream:
        records = list(StreamReader(stream, validate_crcs=True).records)
    kept = [one.data for one in records if isinstance(one, Message)]
    assert isinstance(records[-1], Footer)
    assert kept == payloads[: len(kept)]
    # A piece holds 1 MiB; the last one did not fit, and one may have made room for the end.
    assert sum(map(len, kept)) >= size - 2.2 * 2**20
    if kept:
        assert recover(path, tmp_path / "b.mcap") == len(kept)
        assert [one.data for one in read_log(tmp_path / "b.mcap")] == kept


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
