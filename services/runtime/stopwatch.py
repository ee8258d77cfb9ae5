"""Measures how long handlers take in this process; what is measured never enters a message."""

import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import Any

from schemas.topics import Handler, Handlers, Output, Topic
from services.runtime.node import Closable, Node


class Stopwatch:
    """Mean handler times by node and topic."""

    def __init__(self) -> None:
        self._spent: dict[tuple[str, str], list[float]] = defaultdict(list)

    def timed(self, name: str, node: Node) -> "TimedNode":
        """The same node, with its handlers timed."""
        return TimedNode(node, lambda key, seconds: self._spent[name, key].append(seconds))

    def mean_ms(self, name: str, topic: Topic[Any]) -> float:
        """Mean time of one handler [ms]; 0 if it never ran."""
        spent = self._spent[name, topic.key]
        return round(1000 * sum(spent) / len(spent), 3) if spent else 0.0


class TimedNode:
    """A node seen through a stopwatch."""

    def __init__(self, node: Node, note: Callable[[str, float], None]) -> None:
        self._node, self._note = node, note

    def handlers(self) -> Handlers:
        """The node's handlers, timed."""
        return {topic: self._timed(topic.key, h) for topic, h in self._node.handlers().items()}

    def close(self) -> None:
        """Let the node go."""
        if isinstance(self._node, Closable):
            self._node.close()

    def _timed(self, key: str, handler: Handler) -> Handler:
        def handle(message: Any) -> Iterable[Output]:
            started = time.perf_counter()
            outputs = list(handler(message))
            self._note(key, time.perf_counter() - started)
            return outputs

        return handle
