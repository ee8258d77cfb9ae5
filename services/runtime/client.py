"""What a person does to a running system from the command line."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from msgspec import Struct

from schemas import topics
from schemas.codec import MalformedMessageError, decode
from schemas.fleet import Access
from schemas.health import StatusRequest, SystemStatus
from schemas.language import Annotations, Answer, Instruction
from schemas.motion import StopLatch
from schemas.task import CancelRequest, InstructionStatus, TaskState
from schemas.topics import Topic
from services.runtime import clock
from services.runtime.joining import (
    ClockOffset,
    ask_access,
    find_run,
    measure_clock,
    require_access,
)
from services.runtime.link import Link
from services.runtime.mailbox import Sample
from services.runtime.run_directory import RunDirectory, SystemInfo
from services.runtime.wire import Bus

_repeats = 3
_timeout_ms = 2000
_ready_timeout_s = 60.0


class Client:
    """Talks to the system of one realm. Use it as a context manager.

    Args:
        realm: of the system.
        link: to a hub on another machine; without it the system is one on this machine.

    Raises:
        NotRunningError: no system runs in this realm on this machine.
        NoSystemError: no hub at the other end, or it does not let us in.
    """

    def __init__(self, realm: str, link: Link | None = None) -> None:
        self.info: SystemInfo = (
            RunDirectory.of(realm).info() if link is None else _info_of(link, realm)
        )
        link = Link.to(self.info.endpoint, Path(self.info.tls) if self.info.tls else None)
        run = self.info.run
        self._bus = Bus.client(link.endpoint, run.realm, run.robot, _timeout_ms, link.identity)
        self._is_local = link.identity is None

    def access(self) -> Access:
        """What the hub lets us do.

        Raises:
            NoAnswerError: the hub does not say.
        """
        return ask_access(self._bus)

    def clock_offset(self) -> ClockOffset:
        """How this machine's clock stands to the hub's.

        Raises:
            NoAnswerError: the hub does not say.
        """
        return measure_clock(self._bus)

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self._bus.close()

    def status(self) -> SystemStatus:
        """How every service is.

        Raises:
            NoAnswerError: the supervisor does not answer.
        """
        return self._bus.ask(topics.STATUS, StatusRequest(stamp_ns=clock.now_ns()))

    def say(self, text: str, source: str = "cli") -> Instruction:
        """Send an instruction once the system is ready to hear it."""
        self._require(topics.INSTRUCTION)
        self._wait_until_ready()
        stamp_ns = clock.now_ns()
        instruction = Instruction(
            stamp_ns=stamp_ns, id=f"{source}-{stamp_ns}", text=text, source=source
        )
        self._bus.publish(topics.INSTRUCTION.of(instruction))
        return instruction

    def answer(self, text: str, instruction_id: str = "", source: str = "cli") -> Answer:
        """Answer the question of an instruction; "" is whichever question is open."""
        self._require(topics.ANSWER)
        answer = Answer(
            stamp_ns=clock.now_ns(), instruction_id=instruction_id, text=text, source=source
        )
        self._bus.publish(topics.ANSWER.of(answer))
        return answer

    def latch_stop(self, stopped: bool, source: str = "cli") -> None:
        """Stop all motion, or release the stop. Sent several times: it must arrive."""
        self._require(topics.STOP)
        for _ in range(_repeats):
            latch = StopLatch(stamp_ns=clock.now_ns(), stopped=stopped, source=source)
            self._bus.publish(topics.STOP.of(latch))
            time.sleep(0.02)

    def cancel(self, source: str = "cli") -> None:
        """Drop the instruction."""
        self._require(topics.CANCEL)
        self._bus.publish(topics.CANCEL.of(CancelRequest(stamp_ns=clock.now_ns(), source=source)))
        time.sleep(0.05)

    def watch(self, *watched: Topic[Any]) -> "Subscription":
        """Messages of some topics from now on, state topics with their last value first."""
        if not self._is_local:
            require_access(self.access(), "watch", (), [topic.key for topic in watched])
        return Subscription(self._bus, watched)

    def _require(self, topic: Topic[Any]) -> None:
        """A hub elsewhere refuses without a word; here it is said."""
        if not self._is_local:
            require_access(self.access(), topic.key, [topic.key], ())

    def _wait_until_ready(self) -> None:
        deadline = time.monotonic() + _ready_timeout_s
        while not self.status().ready and time.monotonic() < deadline:
            time.sleep(0.1)


def _info_of(link: Link, realm: str) -> SystemInfo:
    tls = str(link.identity.folder) if link.identity else ""
    run = find_run(link, realm, _timeout_ms)
    return SystemInfo(pid=0, endpoint=link.endpoint, address="", log="", run=run, tls=tls)


class Subscription:
    """An iterator over messages."""

    def __init__(self, bus: Bus, watched: tuple[Topic[Any], ...]) -> None:
        self._queue: SimpleQueue[Sample] = SimpleQueue()
        for topic in watched:
            bus.subscribe(topic, self._queue.put)
            last = bus.last_value(topic) if topic.keep_last else None
            if last is not None:
                self._queue.put(last)

    def messages(self, timeout_s: float) -> Iterator[tuple[Topic[Any], Struct]]:
        """Messages until nothing came for a while; what does not decode is passed over."""
        while True:
            try:
                sample = self._queue.get(timeout=timeout_s)
            except Empty:
                return
            try:
                yield sample.topic, decode(sample.payload, sample.topic.type)
            except MalformedMessageError:
                continue


def follow_instruction(
    subscription: Subscription,
    instruction_id: str,
    timeout_s: float,
    on_progress: Callable[[Annotations | InstructionStatus], bool | None],
) -> InstructionStatus | None:
    """Follow an instruction to its end; None if that takes longer than the timeout.

    It ends as well when `on_progress` returns True; the last status is then returned.
    """
    deadline = time.monotonic() + timeout_s
    last: InstructionStatus | None = None
    while (left := deadline - time.monotonic()) > 0:
        for _, message in subscription.messages(min(left, 0.5)):
            if not isinstance(message, Annotations | InstructionStatus):
                continue
            if message.instruction_id == instruction_id:
                enough = on_progress(message)
                if isinstance(message, InstructionStatus):
                    last, enough = message, enough or message.state is not TaskState.ACTIVE
                if enough:
                    return last
            if time.monotonic() > deadline:
                break
    return None
