"""Lockstep and the wire agree: what a node said in lockstep, it says as a process too.

A short episode is run in lockstep. Then each node, started as a process of its own, is fed over
loopback what it had handled, message by message, and must say the same.
"""

import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import pytest

from schemas import topics
from schemas.codec import as_builtins, decode
from schemas.health import Heartbeat
from schemas.language import Instruction
from schemas.run import RunConfig
from services.process_table import PROCESSES, Process
from services.runtime.lockstep import Lockstep
from services.runtime.mailbox import Sample
from services.runtime.wire import Bus
from services.runtime.worker import build_node

run = RunConfig(realm="agreement", seed=3, particles=30)
seconds = 8
members = [process for process in PROCESSES if process.lockstep and process.takes_part(run)]


@dataclass
class Recording:
    """What every node handled and said, in order."""

    handled: dict[str, list[Sample]] = field(default_factory=lambda: defaultdict(list))
    said: dict[str, list[Sample]] = field(default_factory=lambda: defaultdict(list))


@pytest.fixture(scope="module")
def recording() -> Recording:
    kept = Recording()
    lockstep = Lockstep(
        {process: build_node(process, run) for process in members},
        on_message=lambda name, _stamp_ns, sample: kept.said[name].append(sample),
        on_handled=lambda name, sample: kept.handled[name].append(sample),
    )
    lockstep.run(until_ns=500_000_000)
    text = "go to the hydrant behind the cone"
    instruction = Instruction(stamp_ns=lockstep.now_ns, id="1", text=text, source="test")
    lockstep.send(topics.INSTRUCTION.of(instruction))
    lockstep.run(until_ns=seconds * 1_000_000_000)
    lockstep.close()
    return kept


@contextmanager
def child(process: Process, folder: Path, endpoint: str) -> Generator[None]:
    config = folder / "config.json"
    config.write_bytes(msgspec.json.encode(run))
    command = [sys.executable, "-m", "services.runtime.process", process.name, str(config)]
    started = subprocess.Popen([*command, endpoint, "stepped"])
    try:
        yield
    finally:
        started.terminate()
        started.wait(10)


def wait_until(condition: object, limit_s: float, what: str) -> None:
    deadline = time.monotonic() + limit_s
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < deadline, f"{what} did not happen within {limit_s:g} s"
        time.sleep(0.0005)


@pytest.mark.parametrize("process", members, ids=lambda process: process.name)
def test_a_node_says_the_same_as_a_process(
    process: Process, recording: Recording, tmp_path: Path
) -> None:
    endpoint = f"unixsock-stream/{tmp_path / 'hub.sock'}"
    heard: dict[str, list[Sample]] = defaultdict(list)
    beats: list[int] = []
    ready: list[str] = []
    with Bus.hub(endpoint, run.realm, run.robot) as hub, child(process, tmp_path, endpoint):
        hub.watch_ready(lambda name, there: ready.append(name) if there else None)
        for topic in process.publishes:
            hub.subscribe(topic, lambda sample: heard[sample.topic.key].append(sample))
        hub.subscribe(
            topics.HEARTBEAT, lambda s: beats.append(decode(s.payload, Heartbeat).handled)
        )
        wait_until(lambda: ready, 30, f"{process.name} ready")
        for count, sample in enumerate(recording.handled[process.name], start=1):
            hub.publish_bytes(sample.topic, sample.payload)
            wait_until(lambda count=count: beats and beats[-1] >= count, 10, f"message {count}")
        time.sleep(0.2)
    expected: dict[str, list[Sample]] = defaultdict(list)
    for sample in recording.said[process.name]:
        expected[sample.topic.key].append(sample)
    assert expected, f"{process.name} said nothing in lockstep"
    for key, samples in expected.items():
        # What was still to be published when lockstep ended is said on the wire all the same.
        answers = heard[key][: len(samples)]
        for number, (answer, sample) in enumerate(zip(answers, samples, strict=True)):
            given, wanted = (as_builtins(decode(s.payload, s.topic.type)) for s in (answer, sample))
            assert given == wanted, f"{key} #{number}"
