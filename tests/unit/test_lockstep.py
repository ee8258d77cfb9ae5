"""Laws of the lockstep executor, on toy nodes."""

from collections.abc import Iterable

import numpy as np

from schemas import topics
from schemas.geometry import Pose2
from schemas.health import Tick
from schemas.sensing import Odometry
from schemas.task import CancelRequest
from schemas.topics import Handlers, Output
from services.process_table import Process
from services.runtime.lockstep import Lockstep
from services.runtime.mailbox import Sample
from services.runtime.trace import Trace


class Source:
    """Sends odometry with every tick."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def handlers(self) -> Handlers:
        return {topics.TICK: self.on_tick}

    def on_tick(self, tick: Tick) -> Iterable[Output]:
        pose = Pose2(self._rng.normal(), 0.0, 0.0)
        yield topics.ODOMETRY.of(
            Odometry(
                stamp_ns=tick.stamp_ns,
                odom_from_base=pose,
                linear=0.0,
                angular=0.0,
                variance_per_metre=0.0,
                variance_per_radian=0.0,
            )
        )


class Slow:
    """Remembers what it handled."""

    def __init__(self) -> None:
        self.odometry: list[int] = []
        self.cancels: list[int] = []

    def handlers(self) -> Handlers:
        return {topics.ODOMETRY: self.on_odometry, topics.CANCEL: self.on_cancel}

    def on_odometry(self, odometry: Odometry) -> Iterable[Output]:
        self.odometry.append(odometry.stamp_ns)
        return ()

    def on_cancel(self, cancel: CancelRequest) -> Iterable[Output]:
        self.cancels.append(cancel.stamp_ns)
        return ()


def system(latency_ms: float, seed: int = 0, trace: Trace | None = None) -> tuple[Lockstep, Slow]:
    slow = Slow()
    members = {
        Process("source", "", latency_ms=0.0, tick_hz=20.0): Source(np.random.default_rng(seed)),
        Process("slow", "", latency_ms=latency_ms): slow,
    }
    return Lockstep(members, on_message=trace.note if trace else None), slow


def test_a_fast_node_handles_everything_in_order() -> None:
    lockstep, slow = system(latency_ms=1.0)
    lockstep.run(until_ns=1_000_000_000)
    assert slow.odometry == [50_000_000 * k for k in range(21)]


def test_a_busy_node_gets_the_latest_and_drops_none_of_what_must_not_drop() -> None:
    lockstep, slow = system(latency_ms=120.0)
    for k in range(5):
        lockstep.send(topics.CANCEL.of(CancelRequest(stamp_ns=k, source="test")))
    lockstep.run(until_ns=2_000_000_000)
    assert slow.cancels == list(range(5))
    assert len(slow.odometry) < 20
    assert slow.odometry == sorted(set(slow.odometry))


def test_the_same_seed_gives_the_same_log_and_another_seed_another() -> None:
    logs: list[str] = []
    for seed in (3, 3, 4):
        trace = Trace()
        system(5.0, seed, trace)[0].run(until_ns=1_000_000_000)
        logs.append(trace.sha256)
    assert logs[0] == logs[1] != logs[2]


def test_running_in_pieces_is_running_at_once() -> None:
    whole, pieces = Trace(), Trace()
    system(30.0, 1, whole)[0].run(until_ns=1_000_000_000)
    lockstep, _ = system(30.0, 1, pieces)
    for step in range(1, 11):
        lockstep.run(until_ns=step * 100_000_000)
    assert whole.sha256 == pieces.sha256


def test_results_appear_when_the_modelled_latency_is_over() -> None:
    published: list[tuple[str, int]] = []

    def note(name: str, stamp_ns: int, sample: Sample) -> None:
        published.append((sample.topic.key, stamp_ns))

    members = {
        Process("source", "", latency_ms=7.0, tick_hz=20.0): Source(np.random.default_rng(0))
    }
    Lockstep(members, on_message=note).run(until_ns=60_000_000)
    assert ("odometry", 7_000_000) in published
    assert ("odometry", 57_000_000) in published
