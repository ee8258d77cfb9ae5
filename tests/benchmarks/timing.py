"""Taking turns: whatever else loads the machine loads all contenders alike."""

import time
from collections.abc import Callable, Mapping

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
    """Seconds per call of each contender, one block a round, each round begun by another."""
    repeats = {name: repeats_for(call) for name, call in calls.items()}
    spent: dict[str, list[float]] = {name: [] for name in calls}
    names = list(calls)
    for number in range(rounds):
        start = number % len(names)
        for name in (*names[start:], *names[:start]):
            spent[name].append(_block(calls[name], repeats[name]))
    return {name: np.array(times) for name, times in spent.items()}


def _block(call: Call, repeats: int) -> float:
    started = time.perf_counter()
    for _ in range(repeats):
        call()
    return (time.perf_counter() - started) / repeats
