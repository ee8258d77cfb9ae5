"""Runs one node as a process over the wire."""

import os
import socket
import threading
import time
from collections.abc import Callable, Iterable
from importlib import import_module
from typing import Any, Protocol, runtime_checkable

from schemas import topics
from schemas.codec import MalformedMessageError, decode
from schemas.health import Fault, Heartbeat, StatusRequest, SystemStatus, Tick
from schemas.run import RunConfig
from schemas.topics import Handlers, Output, Topic
from services.process_table import Process
from services.runtime import clock
from services.runtime.clock_watch import ClockWatch
from services.runtime.mailbox import Mailbox, Sample
from services.runtime.node import Closable, Node, Resumable, node_generator
from services.runtime.wire import Bus, NoAnswerError

_idle_s = 0.2
_finish_s = 1.5
"""Less than a supervisor waits before it ends a process by force."""
_fault_period_s = 1.0


@runtime_checkable
class Tap(Protocol):
    """A node that takes every message of every topic as it is, without losing any."""

    def on_sample(self, sample: Sample) -> Iterable[Output]:
        """Take one message, not decoded."""
        ...

    def on_idle(self) -> Iterable[Output]:
        """Called several times a second, between messages."""
        ...


def build_node(process: Process, run: RunConfig) -> Node:
    """Import and construct the node of a process, and hold it to its row of the table."""
    module, name = process.node.split(":")
    node_class: Callable[..., Node] = getattr(import_module(module), name)
    node = node_class(run, node_generator(run, process.name))
    if not isinstance(node, Tap):
        handled = {topic.key for topic in node.handlers()}
        differing = handled ^ {topic.key for topic in process.listens}
        if differing:
            raise ValueError(f"{process.name}: row and handlers differ in {sorted(differing)}")
    return node


class Worker:
    """The loop of one process: take, decode, handle, publish, beat."""

    def __init__(
        self,
        process: Process,
        node: Node,
        bus: Bus,
        *,
        stepped: bool = False,
        clock_watch: ClockWatch | None = None,
    ) -> None:
        self._process, self._node, self._bus = process, node, bus
        self._stepped = stepped
        self._clock_watch = clock_watch
        self._handlers = dict(node.handlers())
        self._tick = (
            clock.Rate(process.tick_hz)
            if process.tick_hz and topics.TICK in self._handlers and not stepped
            else None
        )
        tapped = topics.ALL_TOPICS if isinstance(node, Tap) else self._inputs()
        self._mailbox = Mailbox(tapped, keep_all=isinstance(node, Tap))
        self._changed = threading.Condition()
        self._health = HealthMeter(process.name)
        self._beat = clock.Rate(topics.HEARTBEAT.rate_hz)

    def run(self, stop: threading.Event) -> None:
        """Serve until `stop` is set. Ready is declared once nothing can be missed any more."""
        self._subscribe()
        self._resume()
        self._bus.declare_ready(self._process.name)
        self._wait_for_the_others(stop)
        while not stop.is_set():
            self._beat_if_due()
            self._tick_if_due()
            sample = self._next()
            if sample is not None:
                self._handle(sample)
        self._finish()

    def _finish(self) -> None:
        """A tap takes what has arrived before it ends; others leave it to the next run."""
        waiting = len(self._mailbox) if isinstance(self._node, Tap) else 0
        deadline = time.monotonic() + _finish_s
        while waiting and time.monotonic() < deadline and (sample := self._next()) is not None:
            self._handle(sample)
            waiting -= 1
        if isinstance(self._node, Closable):
            self._node.close()

    def _inputs(self) -> list[Topic[Any]]:
        own_clock = self._tick is not None
        return [topic for topic in self._handlers if not (own_clock and topic is topics.TICK)]

    def _subscribe(self) -> None:
        if isinstance(self._node, Tap):
            self._bus.subscribe_all(self._enqueue)
            return
        for topic in self._inputs():
            self._bus.subscribe(topic, self._enqueue)

    def _enqueue(self, sample: Sample) -> None:
        with self._changed:
            self._mailbox.put(sample)
            self._changed.notify()

    def _resume(self) -> None:
        """First the node's own last state, then what it missed of the others' state."""
        if isinstance(self._node, Tap) or self._stepped:
            return
        own: Handlers = self._node.resume() if isinstance(self._node, Resumable) else {}
        for topic, handler in own.items():
            sample = self._bus.last_value(topic)
            if sample is not None:
                self._publish(handler(decode(sample.payload, topic.type)))
        for topic in self._inputs():
            if topic.keep_last and topic not in own:
                sample = self._bus.last_value(topic)
                if sample is not None:
                    self._enqueue(sample)

    def _wait_for_the_others(self, stop: threading.Event) -> None:
        while not (stop.is_set() or self._stepped or self._system_ready()):
            self._beat_if_due()
            stop.wait(0.05)

    def _system_ready(self) -> bool:
        try:
            status: SystemStatus = self._bus.ask(topics.STATUS, StatusRequest(stamp_ns=0))
        except NoAnswerError:
            return False
        return status.ready

    def _next(self) -> Sample | None:
        limit = min(_idle_s, self._beat.wait_s(), self._tick.wait_s() if self._tick else _idle_s)
        with self._changed:
            if not len(self._mailbox):
                self._changed.wait(limit)
            return self._mailbox.take()

    def _tick_if_due(self) -> None:
        if self._tick is not None and self._tick.due():
            handler = self._handlers[topics.TICK]
            self._timed(lambda: handler(Tick(stamp_ns=clock.now_ns())))

    def _handle(self, sample: Sample) -> None:
        if isinstance(self._node, Tap):
            tap = self._node
            self._timed(lambda: tap.on_sample(sample))
            return
        try:
            message = decode(sample.payload, sample.topic.type)
        except MalformedMessageError as error:
            self._report("malformed message", f"{sample.topic.key}: {error}")
            return
        handler = self._handlers[sample.topic]
        self._timed(lambda: handler(message))
        if self._stepped:
            self._bus.publish(topics.HEARTBEAT.of(self._health.beat(self._mailbox)))

    def _timed(self, handle: Callable[[], Iterable[Output]]) -> None:
        started = time.perf_counter()
        self._publish(handle())
        self._health.handled(time.perf_counter() - started)

    def _publish(self, outputs: Iterable[Output]) -> None:
        for output in outputs:
            if self._process.guest:
                self._refuse(output)
            else:
                self._bus.publish(output)

    def _refuse(self, output: Output) -> None:
        """The hub would do it without a word; the node is told, so that it can show it."""
        fault = Fault(
            stamp_ns=clock.now_ns(),
            node=self._process.name,
            what="only looks",
            detail=f"{output.topic.key} was not sent",
        )
        if topics.FAULT in self._handlers:
            self._handlers[topics.FAULT](fault)

    def _beat_if_due(self) -> None:
        if self._beat.due() and not (self._stepped or self._process.guest):
            offset_ms = self._clock_watch.offset_ms if self._clock_watch else 0.0
            self._bus.publish(topics.HEARTBEAT.of(self._health.beat(self._mailbox, offset_ms)))
            if isinstance(self._node, Tap):
                self._publish(self._node.on_idle())

    def _report(self, what: str, detail: str) -> None:
        if self._health.malformed_message():
            fault = Fault(
                stamp_ns=clock.now_ns(), node=self._process.name, what=what, detail=detail[:500]
            )
            self._publish([topics.FAULT.of(fault)])


class HealthMeter:
    """Counts what a heartbeat tells."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._total = self._malformed = 0
        self._recent: list[tuple[float, float]] = []
        self._last_fault = -_fault_period_s

    def handled(self, seconds: float) -> None:
        """Count one handled message."""
        self._total += 1
        self._recent.append((time.monotonic(), seconds))

    def malformed_message(self) -> bool:
        """Count one; True if it is time to report again (at most once a second)."""
        self._malformed += 1
        now = time.monotonic()
        if now - self._last_fault < _fault_period_s:
            return False
        self._last_fault = now
        return True

    def beat(self, mailbox: Mailbox, clock_offset_ms: float = 0.0) -> Heartbeat:
        """What to tell now."""
        now = time.monotonic()
        self._recent = [(at, spent) for at, spent in self._recent if now - at < 1.0]
        spent = sum(spent for _, spent in self._recent)
        return Heartbeat(
            stamp_ns=clock.now_ns(),
            node=self._name,
            pid=os.getpid(),
            handled=self._total,
            busy=min(1.0, spent),
            lost=mailbox.lost,
            replaced=mailbox.replaced,
            malformed=self._malformed,
            handler_ms=1000 * spent / len(self._recent) if self._recent else 0.0,
            host=socket.gethostname(),
            clock_offset_ms=clock_offset_ms,
        )
