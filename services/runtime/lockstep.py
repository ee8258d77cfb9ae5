"""Runs all nodes in one process against modelled time, as fast as it computes.

Events lie in a heap ordered by (due time, topic rank, sequence). A node is busy for its modelled
latency; what arrives meanwhile waits in the same mailbox as on the wire, where a newer
latest-wins message replaces an older one. Every message passes through the codec, so nothing can
be shared by accident. Same seed, same log, byte for byte.
"""

import heapq
import itertools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from msgspec import Struct

from schemas import topics
from schemas.codec import decode, encode
from schemas.health import Tick
from schemas.topics import Handlers, Output
from services.process_table import Process
from services.runtime.mailbox import Mailbox, Sample
from services.runtime.node import Closable, Node

Listener = Callable[[str, int, Sample], None]
"""Called with (publisher, time published [ns], sample) for every message."""

HandledListener = Callable[[str, Sample], None]
"""Called with (node, sample) when a node takes a message up."""


@dataclass
class _Member:
    """One node, its inbox and until when it is busy."""

    process: Process
    node: Node
    handlers: Handlers
    mailbox: Mailbox
    number: int
    busy_until_ns: int = 0
    sequences: dict[str, int] = field(default_factory=dict[str, int])


class Lockstep:
    """The executor. `run` advances time; nothing happens in between."""

    def __init__(
        self,
        members: Mapping[Process, Node],
        start_ns: int = 0,
        on_message: Listener | None = None,
        on_handled: HandledListener | None = None,
    ) -> None:
        self.now_ns = start_ns
        self._on_message = on_message
        self._on_handled = on_handled
        self._order = itertools.count()
        self._events: list[tuple[int, int, int, Callable[[], None]]] = []
        self._members = [
            self._member(process, node, number)
            for number, (process, node) in enumerate(members.items(), start=1)
        ]
        self._outside: dict[str, int] = {}
        for member in self._members:
            if member.process.tick_hz and topics.TICK in member.handlers:
                self._schedule_tick(member, start_ns)

    def send(self, output: Output) -> None:
        """Publish a message from outside now, as a person would."""
        self._publish("outside", 0, self._outside, output)

    def run(self, until_ns: int, stop: Callable[[], bool] = lambda: False) -> None:
        """Handle events in order until a time [ns] or until `stop()` is true."""
        while self._events and self._events[0][0] <= until_ns and not stop():
            self.now_ns, _, _, act = heapq.heappop(self._events)
            act()

    def close(self) -> None:
        """Let every node go."""
        for member in self._members:
            if isinstance(member.node, Closable):
                member.node.close()

    def _member(self, process: Process, node: Node, number: int) -> _Member:
        handlers = node.handlers()
        return _Member(process, node, handlers, Mailbox(handlers), number)

    def _schedule(self, due_ns: int, rank: int, act: Callable[[], None]) -> None:
        heapq.heappush(self._events, (due_ns, rank, next(self._order), act))

    def _schedule_tick(self, member: _Member, due_ns: int) -> None:
        def tick() -> None:
            message = Tick(stamp_ns=self.now_ns)
            sample = self._sample(0, self._outside, topics.TICK.of(message))
            self._announce("clock", sample)
            self._arrive(member, sample)
            self._schedule_tick(member, due_ns + round(1e9 / member.process.tick_hz))

        self._schedule(due_ns, topics.TICK.rank, tick)

    def _publish(self, name: str, number: int, sequences: dict[str, int], output: Output) -> None:
        sample = self._sample(number, sequences, output)
        self._announce(name, sample)
        for member in self._members:
            if output.topic in member.handlers:
                self._schedule(
                    self.now_ns,
                    output.topic.rank,
                    lambda member=member: self._arrive(member, sample),
                )

    def _sample(self, number: int, sequences: dict[str, int], output: Output) -> Sample:
        key = output.topic.key
        sequence = sequences.get(key, 0)
        sequences[key] = sequence + 1
        return Sample(output.topic, encode(output.message), number, sequence, self.now_ns)

    def _announce(self, name: str, sample: Sample) -> None:
        if self._on_message is not None:
            self._on_message(name, self.now_ns, sample)

    def _arrive(self, member: _Member, sample: Sample) -> None:
        member.mailbox.put(sample)
        if member.busy_until_ns <= self.now_ns:
            self._work(member)

    def _work(self, member: _Member) -> None:
        """Take the next message up. Its results appear when the modelled latency is over."""
        sample = member.mailbox.take()
        if sample is None:
            return
        if self._on_handled is not None:
            self._on_handled(member.process.name, sample)
        outputs = self._handle(member, sample)
        member.busy_until_ns = self.now_ns + round(member.process.latency_ms * 1e6)
        self._schedule(
            member.busy_until_ns, sample.topic.rank, lambda: self._finish(member, outputs)
        )

    def _handle(self, member: _Member, sample: Sample) -> list[Output]:
        message: Struct = decode(sample.payload, sample.topic.type)
        outputs: Iterable[Output] = member.handlers[sample.topic](message)
        return list(outputs)

    def _finish(self, member: _Member, outputs: list[Output]) -> None:
        for output in outputs:
            self._publish(member.process.name, member.number, member.sequences, output)
        self._work(member)


def message_of(sample: Sample) -> Any:
    """Decode a sample by its topic's type."""
    return decode(sample.payload, sample.topic.type)
