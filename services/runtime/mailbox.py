"""Where messages wait for a node: the same rules on the wire and in lockstep."""

import heapq
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from schemas.topics import Qos, Topic

_after_all_ranks = 1000
KEPT_BYTES = 64_000_000
"""Of each topic, what may wait for one who must not miss anything and gets no processor."""


@dataclass(frozen=True)
class Sample:
    """One message as it arrived, not decoded yet."""

    topic: Topic[Any]
    payload: bytes
    publisher: int
    """Random number of the publishing process."""
    sequence: int
    """Per publisher and topic, from 0 without gaps."""
    sent_ns: int
    """Sender's clock when it was published, since the epoch."""


class Mailbox:
    """Queues by topic. `take` gives never-drop messages first, by rank and age, then the rest.

    The rest go by the age of their place in the queue alone: by rank, an overloaded node would
    handle its fastest stream for ever and starve the others.

    Latest-wins topics hold one message; never-drop topics hold `Topic.queue` and count what they
    had to let go. With `keep_all` every topic is treated as never-drop, and holds `KEPT_BYTES`.
    """

    def __init__(self, topics: Iterable[Topic[Any]], *, keep_all: bool = False) -> None:
        self._queues: dict[str, deque[Sample]] = {}
        self._bytes: dict[str, int] = {}
        for topic in topics:
            self._queues[topic.key] = deque()
            self._bytes[topic.key] = 0
        self._order: list[tuple[int, int, str]] = []
        self._arrivals = 0
        self._loss = LossCounter(every_topic=keep_all)
        self._keep_all = keep_all
        self.replaced = 0
        self._overflowed = 0

    @property
    def lost(self) -> int:
        """Never-drop messages that did not arrive, or that did not fit."""
        return self._loss.lost + self._overflowed

    def put(self, sample: Sample) -> bool:
        """Add a sample; False if it was seen before (a replayed last value)."""
        topic = sample.topic
        if not self._loss.note(sample):
            return False
        queue = self._queues[topic.key]
        if self._is_full(topic, queue):
            self._bytes[topic.key] -= len(queue.popleft().payload)
            if topic.qos is Qos.LATEST_WINS and not self._keep_all:
                self.replaced += 1
            else:
                self._overflowed += 1
        else:
            heapq.heappush(self._order, (self._urgency(topic), self._arrivals, topic.key))
        self._arrivals += 1
        queue.append(sample)
        self._bytes[topic.key] += len(sample.payload)
        return True

    def take(self) -> Sample | None:
        """Remove and return the next sample, or None."""
        if not self._order:
            return None
        _, _, key = heapq.heappop(self._order)
        sample = self._queues[key].popleft()
        self._bytes[key] -= len(sample.payload)
        return sample

    def __len__(self) -> int:
        return len(self._order)

    def _is_full(self, topic: Topic[Any], queue: deque[Sample]) -> bool:
        if self._keep_all:
            return bool(queue) and self._bytes[topic.key] >= KEPT_BYTES
        return len(queue) >= (1 if topic.qos is Qos.LATEST_WINS else topic.queue)

    def _urgency(self, topic: Topic[Any]) -> int:
        if self._keep_all:
            return 0
        return topic.rank if topic.qos is Qos.NEVER_DROP else _after_all_ranks


class LossCounter:
    """Finds gaps in the sequence numbers of each publisher and topic."""

    def __init__(self, *, every_topic: bool = False) -> None:
        self.lost = 0
        self._every_topic = every_topic
        self._next: dict[tuple[int, str], int] = {}

    def note(self, sample: Sample) -> bool:
        """Count what is missing before this sample; False if it is a repeat."""
        stream = (sample.publisher, sample.topic.key)
        expected = self._next.get(stream)
        if expected is not None and sample.sequence < expected:
            return False
        counts = self._every_topic or sample.topic.qos is Qos.NEVER_DROP
        if expected is not None and counts:
            self.lost += sample.sequence - expected
        self._next[stream] = sample.sequence + 1
        return True
