"""A picture at even times out of messages that come when they come."""

from collections.abc import Iterable, Iterator
from typing import TypeVar

T = TypeVar("T")


def evenly(timed: Iterable[tuple[int, T]], period_ns: int) -> Iterator[T]:
    """Of (time, thing) in order of time: at each multiple of the period the newest thing."""
    due_ns: int | None = None
    newest: T | None = None
    for at_ns, thing in timed:
        due_ns = at_ns if due_ns is None else due_ns
        while newest is not None and at_ns > due_ns:
            yield newest
            due_ns += period_ns
        newest = thing
    if newest is not None:
        yield newest
