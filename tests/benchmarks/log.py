"""The log: whether the recorder keeps up, what it costs, what a kill loses, how files open.

The messages are those of the recordings of `tests.replay`, at the rates of the table of topics.
"""

import itertools
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from schemas import topics
from schemas.codec import decode
from schemas.health import Heartbeat, SystemStatus
from schemas.run import RunConfig
from schemas.topics import ALL_TOPICS, Topic
from services.recorder.run_log import RunLog
from services.runtime.log_file import log_summary, read_log
from services.runtime.mailbox import Sample
from services.runtime.provenance import run_metadata
from services.runtime.record import LogWriter
from services.runtime.repair import check_log, recover
from services.runtime.replay import recorded_run
from services.runtime.wire import Bus
from tests.benchmarks.rows import Row, compared, quantile, quantile_interval
from tests.benchmarks.timing import turned
from tests.replay.cases import CASES

PEER = f"mcap {version('mcap')} without channels for viewers"
_times_normal = 10
_event_hz = 0.5
"""Of topics that follow events."""
_large_bytes = 1_000_000_000
_root = Path(__file__).parents[2]
_realm = "bench-log"
_patience_s = 20.0
_ready_system = SystemStatus(
    stamp_ns=0, realm=_realm, robot="husky", world="", ready=True, services=(), faults=()
)


@dataclass(frozen=True)
class Traffic:
    """Real messages of every topic that has some, and how often they come."""

    payloads: dict[str, list[bytes]]

    def second(self, times: int = 1) -> list[tuple[float, Topic[Any]]]:
        """When which topic is due within a second, in order."""
        due = [
            (number / rate, topic)
            for topic in ALL_TOPICS
            if topic.key in self.payloads
            for rate in (times * (topic.rate_hz or _event_hz),)
            for number in range(max(1, round(rate)))
        ]
        return sorted(due, key=lambda one: one[0])

    def messages(self) -> dict[str, Iterator[bytes]]:
        """The payloads of each topic, over and over."""
        return {key: itertools.cycle(payloads) for key, payloads in self.payloads.items()}


def traffic() -> Traffic:
    """What the services heard and said in the recordings."""
    payloads: dict[str, list[bytes]] = {}
    for case in CASES:
        for record in read_log(case.path):
            payloads.setdefault(record.topic, []).append(record.data)
    return Traffic(payloads)


def measure(rounds: int) -> list[Row]:
    """Losses over so many seconds, costs of so many seconds of traffic; kills and files fewer."""
    kept = traffic()
    with tempfile.TemporaryDirectory(prefix="bench-log-") as name:
        folder = Path(name)
        return [
            _keeping_up(folder, kept, rounds),
            _cost(folder, kept, rounds),
            _killed(folder, kept, max(3, rounds // 5)),
            *_opening(folder, max(3, rounds // 5)),
        ]


def _keeping_up(folder: Path, kept: Traffic, seconds: int) -> Row:
    """The recorder as a process, at ten times the traffic."""
    path = folder / "fast.mcap"
    with _recorder(folder, path) as (hub, child):
        beats: list[Heartbeat] = []
        hub.subscribe(topics.HEARTBEAT, lambda one: beats.append(decode(one.payload, Heartbeat)))
        sent = _publish(hub, kept, seconds, _times_normal)
        _wait_until_handled(beats, sum(sent.values()))
        child.terminate()
        child.wait(_patience_s)
    counts = log_summary(path)["topics"]
    lost = sum(sent.values()) - sum(counts.get(key, 0) for key in sent)
    if not lost:
        lost = len(check_log(path))
    return _limited(
        f"recorder at {_times_normal} times the traffic of a run", "messages lost", "", [lost], 0.0
    )


def _cost(folder: Path, kept: Traffic, rounds: int) -> Row:
    """Processor time that one second of normal traffic takes, in turn with plain files."""
    run = RunConfig()
    writers: dict[str, RunLog | LogWriter] = {
        "ours": RunLog(folder / "ours.mcap", run),
        PEER: LogWriter(folder / "plain.mcap", run_metadata(run)),
    }
    spent: dict[str, list[float]] = {name: [] for name in writers}
    messages = {name: kept.messages() for name in writers}
    for number in range(rounds):
        for name in turned(list(writers), number):
            spent[name].append(_second_ms(writers[name], kept, messages[name], number))
    for writer in writers.values():
        writer.close()
    ours, theirs = (np.array(spent[name]) for name in ("ours", PEER))
    return compared(
        "recorder, a second of a run", "processor time", "ms", ours, (PEER, theirs), drift=2.0
    )


def _second_ms(
    writer: RunLog | LogWriter, kept: Traffic, messages: dict[str, Iterator[bytes]], number: int
) -> float:
    started = time.process_time()
    for at_s, topic in kept.second():
        now_ns = round(1e9 * (number + at_s))
        writer.write(Sample(topic, next(messages[topic.key]), 1, 0, now_ns), now_ns)
    return 1000 * (time.process_time() - started)


def _killed(folder: Path, kept: Traffic, times: int) -> Row:
    """From the last message that was sent to the last that is in the mended file."""
    lost_s: list[float] = []
    for number in range(times):
        path, mended = folder / f"killed-{number}.mcap", folder / f"mended-{number}.mcap"
        with _recorder(folder, path) as (hub, child):
            _publish(hub, kept, 2, 1)
            killed_ns = time.time_ns()
            os.kill(child.pid, signal.SIGKILL)
            child.wait(_patience_s)
        recover(path, mended)
        lost_s.append((killed_ns - max(record.log_ns for record in read_log(mended))) / 1e9)
    return _limited("recorder killed", "time lost", "s", lost_s, 0.5)


def _opening(folder: Path, times: int) -> list[Row]:
    """A file of a gigabyte: its settings and its first message."""
    path = folder / "large.mcap"
    _write_large(path)
    opened_ms: list[float] = []
    for _ in range(times):
        started = time.perf_counter()
        recorded_run(path)
        next(iter(read_log(path)))
        opened_ms.append(1000 * (time.perf_counter() - started))
    return [_limited("file of 1 GB opened for replay", "time", "ms", opened_ms, 1000.0)]


def _write_large(path: Path) -> None:
    """Compressed as pictures are, in as many pieces as a run of that size."""
    writer = LogWriter(path, run_metadata(RunConfig()))
    noise, numbers = os.urandom(1 << 20), itertools.count()
    others = [topic for topic in ALL_TOPICS if topic is not topics.RGBD]
    while path.stat().st_size < _large_bytes:
        for topic in (topics.RGBD, topics.RGBD, *others):
            number, size = next(numbers), 165_000 if topic is topics.RGBD else 100
            start = number * 7919 % (1 << 19)
            writer.write(Sample(topic, noise[start : start + size], 1, number, number), number)
        writer.flush()
    writer.close()


@contextmanager
def _recorder(folder: Path, path: Path) -> Generator[tuple[Bus, subprocess.Popen[bytes]]]:
    """A hub, and a recorder that is ready."""
    endpoint = f"unixsock-stream/{folder / 'hub.sock'}"
    run = RunConfig(realm=_realm, log=str(path))
    config = folder / "config.json"
    config.write_bytes(msgspec.json.encode(run))
    command = [sys.executable, "-m", "services.runtime.process", "recorder", str(config), endpoint]
    ready: list[str] = []
    with Bus.hub(endpoint, _realm, run.robot) as hub:
        hub.watch_ready(lambda name, there: ready.append(name) if there else None)
        hub.serve(topics.STATUS, lambda _request: _ready_system)
        child = subprocess.Popen(command, cwd=_root)
        try:
            _until(lambda: bool(ready), "recorder ready")
            yield hub, child
        finally:
            child.kill()
            child.wait()


def _publish(hub: Bus, kept: Traffic, seconds: int, times: int) -> dict[str, int]:
    """Send at an even pace; returns how many of each topic."""
    sent: dict[str, int] = dict.fromkeys(kept.payloads, 0)
    messages, started = kept.messages(), time.monotonic()
    for second in range(seconds):
        for at_s, topic in kept.second(times):
            time.sleep(max(0.0, started + second + at_s - time.monotonic()))
            hub.publish_bytes(topic, next(messages[topic.key]))
            sent[topic.key] += 1
    return sent


def _wait_until_handled(beats: list[Heartbeat], sent: int) -> None:
    """Until the recorder has taken everything up, or has missed some of it."""
    deadline = time.monotonic() + _patience_s
    # It takes up its own heartbeats, too; the last of them may be on their way.
    while time.monotonic() < deadline and not (beats and beats[-1].handled >= sent + len(beats)):
        time.sleep(0.1)


def _until(condition: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + _patience_s
    while not condition():
        assert time.monotonic() < deadline, f"{what}: not within {_patience_s:g} s"
        time.sleep(0.01)


def _limited(row: str, metric: str, unit: str, found: list[float], limit: float) -> Row:
    return Row(
        row=row,
        metric=metric,
        unit=unit,
        better="lower",
        ours=quantile(found),
        interval=quantile_interval(found),
        limit=limit,
    )
