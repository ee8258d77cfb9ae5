"""The wire executor over a real hub: readiness, late joiners, malformed bytes, losses."""

import threading
import time
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from pathlib import Path

import pytest

from schemas import topics
from schemas.codec import decode
from schemas.errors import MissingComponentError
from schemas.health import StatusRequest, SystemStatus
from schemas.language import Instruction
from schemas.task import CancelRequest, InstructionStatus, TaskState
from schemas.topics import Handlers, Output
from services.process_table import Process
from services.runtime.mailbox import Sample
from services.runtime.wire import Bus, NoAnswerError
from services.runtime.worker import Worker

realm, robot = "test", "husky"
echo_row = Process("echo", "", latency_ms=0.0)


def instruction(name: str) -> Instruction:
    return Instruction(stamp_ns=1, id=name, text="go", source="test")


def status_of(name: str) -> InstructionStatus:
    return InstructionStatus(
        stamp_ns=1,
        instruction_id=name,
        text="go",
        state=TaskState.ACTIVE,
        failure=None,
        reason="",
        started_ns=0,
        decisions=0,
    )


class Echo:
    """Answers instructions; remembers what it resumed from."""

    def __init__(self) -> None:
        self.resumed: list[str] = []
        self.heard: list[str] = []
        self.closed = False

    def handlers(self) -> Handlers:
        return {topics.INSTRUCTION: self.on_instruction}

    def resume(self) -> Handlers:
        return {topics.INSTRUCTION_STATUS: self.on_own_status}

    def on_instruction(self, heard: Instruction) -> Iterable[Output]:
        self.heard.append(heard.id)
        return [topics.INSTRUCTION_STATUS.of(status_of(heard.id))]

    def on_own_status(self, status: InstructionStatus) -> Iterable[Output]:
        self.resumed.append(status.instruction_id)
        return ()

    def close(self) -> None:
        self.closed = True


@contextmanager
def running(node: Echo, endpoint: str) -> Generator[Bus]:
    stop = threading.Event()
    with Bus.client(endpoint, realm, robot) as bus:
        thread = threading.Thread(target=Worker(echo_row, node, bus).run, args=(stop,))
        thread.start()
        try:
            yield bus
        finally:
            stop.set()
            thread.join()


@pytest.fixture
def endpoint(tmp_path: Path) -> str:
    return f"unixsock-stream/{tmp_path / 'hub.sock'}"


@pytest.fixture
def hub(endpoint: str) -> Generator[Bus]:
    with Bus.hub(endpoint, realm, robot) as bus:
        bus.serve_last_values()
        ready = SystemStatus(
            stamp_ns=0, realm=realm, robot=robot, world="", ready=True, services=(), faults=()
        )
        bus.serve(topics.STATUS, lambda _request: ready)
        yield bus


def eventually(condition: Callable[[], bool], seconds: float = 5.0) -> bool:
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.01)
    return condition()


def last_status(hub: Bus) -> str:
    """Id of the instruction that the last status is about, "" if there was none yet."""
    sample = hub.last_value(topics.INSTRUCTION_STATUS)
    return decode(sample.payload, InstructionStatus).instruction_id if sample else ""


def test_a_message_is_handled_and_answered(hub: Bus, endpoint: str) -> None:
    answers: list[Sample] = []
    ready: list[str] = []
    hub.subscribe(topics.INSTRUCTION_STATUS, answers.append)
    hub.watch_ready(lambda name, there: ready.append(name) if there else None)
    echo = Echo()
    with running(echo, endpoint):
        assert eventually(lambda: ready == ["echo"])
        for number in range(100):
            hub.publish(topics.INSTRUCTION.of(instruction(str(number))))
        assert eventually(lambda: len(answers) == 100)
    assert echo.heard == [str(number) for number in range(100)]
    assert echo.closed


def test_a_late_joiner_gets_the_last_state_and_its_own(hub: Bus, endpoint: str) -> None:
    with running(Echo(), endpoint):
        hub.publish(topics.INSTRUCTION.of(instruction("first")))
        hub.publish(topics.INSTRUCTION.of(instruction("second")))
        assert eventually(lambda: last_status(hub) == "second")
    reborn = Echo()
    with running(reborn, endpoint):
        assert eventually(lambda: reborn.heard == ["second"])
    assert reborn.resumed == ["second"]


def test_malformed_bytes_are_counted_and_reported_and_kill_nothing(hub: Bus, endpoint: str) -> None:
    faults: list[Sample] = []
    hub.subscribe(topics.FAULT, faults.append)
    echo = Echo()
    with running(echo, endpoint):
        assert eventually(lambda: hub.last_value(topics.INSTRUCTION) is None)
        time.sleep(0.2)
        for payload in (b"", b"\xc1", b"hello", b"\x81\xa2id\x01"):
            hub.publish_bytes(topics.INSTRUCTION, payload)
        hub.publish(topics.INSTRUCTION.of(instruction("good")))
        assert eventually(lambda: echo.heard == ["good"])
        assert eventually(lambda: len(faults) >= 1)
    assert b"malformed" in faults[0].payload


def test_gaps_are_counted_as_losses(hub: Bus, endpoint: str) -> None:
    beats: list[Sample] = []
    hub.subscribe(topics.HEARTBEAT, beats.append)
    with running(Echo(), endpoint):
        time.sleep(0.3)
        for number in (0, 1, 7):
            hub.publish_bytes(topics.INSTRUCTION, b"", number)
        assert eventually(lambda: b"\xa4lost\x05" in beats[-1].payload)


def test_a_question_nobody_answers_is_an_error_not_an_empty_answer(endpoint: str) -> None:
    with (
        Bus.hub(endpoint, realm, robot),
        Bus.client(endpoint, realm, robot) as client,
        pytest.raises(NoAnswerError, match="query/status"),
    ):
        client.ask(topics.STATUS, StatusRequest(stamp_ns=0), timeout_s=0.5)


def test_a_request_that_does_not_decode_gets_the_reason(hub: Bus, endpoint: str) -> None:
    with (
        Bus.client(endpoint, realm, robot) as client,
        pytest.raises(NoAnswerError, match="StatusRequest"),
    ):
        client.ask(topics.STATUS, CancelRequest(stamp_ns="x", source=""))  # type: ignore[arg-type]


def test_no_hub_is_said_within_the_timeout(endpoint: str) -> None:
    with pytest.raises(MissingComponentError, match="hub"):
        Bus.client(endpoint, realm, robot, timeout_ms=300)
