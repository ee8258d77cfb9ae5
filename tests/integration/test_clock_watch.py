"""Clocks of two machines, one of which is wrong."""

import time
from collections.abc import Callable, Generator
from pathlib import Path

import pytest

from schemas import topics
from schemas.codec import decode
from schemas.fleet import ClockReading
from schemas.health import Fault
from services.runtime import clock, clock_watch
from services.runtime.clock_watch import ClockWatch
from services.runtime.joining import ClockError, measure_clock
from services.runtime.mailbox import Sample
from services.runtime.wire import Bus

realm, robot = "clocks", "husky"


class Hub:
    """A hub whose clock is a while ahead."""

    def __init__(self, endpoint: str) -> None:
        self.ahead_s = 0.0
        self.bus = Bus.hub(endpoint, realm, robot)
        self.bus.serve(topics.CLOCK, lambda _request: ClockReading(stamp_ns=self._now_ns()))

    def _now_ns(self) -> int:
        return clock.now_ns() + round(1e9 * self.ahead_s)


@pytest.fixture
def hub(tmp_path: Path) -> Generator[Hub]:
    made = Hub(f"unixsock-stream/{tmp_path / 'hub.sock'}")
    yield made
    made.bus.close()


@pytest.fixture
def bus(hub: Hub, tmp_path: Path) -> Generator[Bus]:
    with Bus.client(f"unixsock-stream/{tmp_path / 'hub.sock'}", realm, robot) as made:
        yield made


def eventually(condition: Callable[[], bool]) -> bool:
    deadline = time.monotonic() + 5.0
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.02)
    return condition()


@pytest.mark.parametrize("ahead_s", [-3.0, 0.0, 0.02, 0.7])
def test_the_offset_is_found_within_what_is_said_of_it(hub: Hub, bus: Bus, ahead_s: float) -> None:
    hub.ahead_s = ahead_s
    measured = measure_clock(bus)
    assert abs(measured.offset_s + ahead_s) <= measured.uncertainty_s + 1e-4


def test_a_service_does_not_begin_with_a_wrong_clock(hub: Hub, bus: Bus) -> None:
    hub.ahead_s = 5.0
    with pytest.raises(ClockError, match="behind the hub's"), ClockWatch(bus, "mapping"):
        pytest.fail("it began")


def test_a_clock_that_jumps_later_is_told(
    hub: Hub, bus: Bus, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clock_watch, "_period_s", 0.05)
    told: list[Sample] = []
    hub.bus.subscribe(topics.FAULT, told.append)
    with ClockWatch(bus, "mapping") as watch:
        assert abs(watch.offset_ms) < 100
        hub.ahead_s = -2.0
        assert eventually(lambda: len(told) > 0)
        assert watch.offset_ms == pytest.approx(2000, abs=200)
    fault = decode(told[0].payload, Fault)
    assert (fault.node, fault.what) == ("mapping", "clocks differ")
    assert "ahead of the hub's" in fault.detail


def test_a_hub_that_is_away_for_a_while_ends_nothing(
    hub: Hub, bus: Bus, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clock_watch, "_period_s", 0.05)
    with ClockWatch(bus, "mapping") as watch:
        before = watch.offset_ms
        hub.bus.close()
        time.sleep(0.5)
        assert watch.offset_ms == pytest.approx(before, abs=100)
