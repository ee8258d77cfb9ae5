"""Taking turns: whatever else loads the machine loads all contenders alike."""

import gc
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np

from tests.benchmarks.rows import Samples

Call = Callable[[], object]


def seconds(call: Call) -> float:
    """Duration of one call [s]."""
    started = time.perf_counter()
    call()
    return time.perf_counter() - started


def repeats_for(call: Call, block_s: float = 0.002) -> int:
    """Number of calls that fill a block long enough for the clock."""
    call()
    return max(1, round(block_s / max(seconds(call), 1e-7)))


def interleaved(calls: Mapping[str, Call], rounds: int) -> dict[str, Samples]:
    """Seconds per call of each contender, one block a round, each round begun by another.

    Garbage is collected between the rounds: within, one contender would pay for another's heap.
    """
    repeats = {name: repeats_for(call) for name, call in calls.items()}
    spent: dict[str, list[float]] = {name: [] for name in calls}
    names = list(calls)
    for number in range(rounds):
        with _without_collection():
            for name in turned(names, number):
                spent[name].append(_block(calls[name], repeats[name]))
    return {name: np.array(times) for name, times in spent.items()}


def turned(names: Sequence[str], number: int) -> Sequence[str]:
    """The same names, begun with another one in every round."""
    start = number % len(names)
    return [*names[start:], *names[:start]]


@contextmanager
def _without_collection() -> Generator[None]:
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def _block(call: Call, repeats: int) -> float:
    started = time.perf_counter()
    for _ in range(repeats):
        call()
    return (time.perf_counter() - started) / repeats
