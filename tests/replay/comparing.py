"""Compares messages field by field."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from schemas.codec import decode
from schemas.topics import Topic
from services.runtime.mailbox import Sample
from tests.replay.running import Step


@dataclass(frozen=True)
class Tolerance:
    """How far a number may be from the reference."""

    absolute: float = 1e-6
    relative: float = 1e-6
    share: float = 0.0
    """Share of an array's numbers that may be further away."""


EXACT = Tolerance(0.0, 0.0)
USUAL = Tolerance()
"""Sums in another order."""
NETWORK = Tolerance(2e-2, 1e-2)
"""A network computes in 32 bits, in another order on each kind of processor."""

TOLERANCES: dict[str, Tolerance] = {
    "detections": NETWORK,
    "detections.boxes_px": Tolerance(0.5, 0.0),
    "detections.view_ranges": USUAL,
    "detections.view_bearings": USUAL,
    "bodies": NETWORK,
    "map/belief": Tolerance(1e-5, 1e-5),
    # A beam that ends at the border of two cells.
    "map/grid": Tolerance(1.0, 0.0, share=1e-3),
}
"""By topic, or by topic and field; the closer name counts."""


def differences(expected: list[Step], given: list[Step]) -> list[str]:
    """What is said otherwise, one line each."""
    return [line for pair in zip(expected, given, strict=True) for line in _of_step(*pair)]


def _of_step(expected: Step, given: Step) -> Iterator[str]:
    heard = f"step {expected.heard.sent_ns} ({expected.heard.topic.key})"
    topics = [[sample.topic.key for sample in step.said] for step in (expected, given)]
    if topics[0] != topics[1]:
        yield f"{heard}: said {topics[1]}, before {topics[0]}"
        return
    for before, now in zip(expected.said, given.said, strict=True):
        for line in _of_message(before, now):
            yield f"{heard}: {before.topic.key}{line}"


def _of_message(before: Sample, now: Sample) -> Iterator[str]:
    topic = before.topic
    pair = [decode(sample.payload, topic.type) for sample in (before, now)]
    for name in topic.type.__struct_fields__:
        values = [getattr(message, name) for message in pair]
        yield from _of_value(f".{name}", *values, tolerance_of(topic, name))


def tolerance_of(topic: Topic[Any], field: str) -> Tolerance:
    return TOLERANCES.get(f"{topic.key}.{field}") or TOLERANCES.get(topic.key) or USUAL


def _of_value(path: str, before: Any, now: Any, tolerance: Tolerance) -> Iterator[str]:
    if isinstance(before, np.ndarray):
        yield from _of_array(path, before, now, tolerance)
    elif isinstance(before, float):
        yield from _of_array(path, np.array(before), np.array(now), tolerance)
    elif isinstance(before, msgspec.Struct):
        for name in before.__struct_fields__:
            inner = (getattr(before, name), getattr(now, name))
            yield from _of_value(f"{path}.{name}", *inner, tolerance)
    elif isinstance(before, tuple) and len(before) == len(now):
        for index, pair in enumerate(zip(before, now, strict=True)):
            yield from _of_value(f"{path}[{index}]", *pair, tolerance)
    elif before != now:
        yield f"{path}: {now!r}, before {before!r}"


def _of_array(
    path: str, before: np.ndarray, now: np.ndarray, tolerance: Tolerance
) -> Iterator[str]:
    if before.shape != now.shape:
        yield f"{path}: shape {now.shape}, before {before.shape}"
        return
    if before.dtype.kind in "iub" and tolerance.share == 0:
        tolerance = EXACT
    a, b = before.astype(np.float64), now.astype(np.float64)
    far = ~np.isclose(b, a, rtol=tolerance.relative, atol=tolerance.absolute, equal_nan=True)
    if far.sum() > tolerance.share * far.size:
        worst = np.unravel_index(np.argmax(np.where(far, np.abs(b - a), 0.0)), far.shape)
        place = "".join(f"[{index}]" for index in worst)
        yield (
            f"{path}{place}: {b[worst]:.9g}, before {a[worst]:.9g} "
            f"({far.sum()} of {far.size} numbers are too far away)"
        )
