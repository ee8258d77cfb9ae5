"""Keeps measuring how this machine's clock stands to the hub's while a service runs."""

import threading

from schemas import topics
from schemas.health import Fault
from services.runtime import clock
from services.runtime.joining import ClockError, measure_clock
from services.runtime.wire import Bus, NoAnswerError

_period_s = 10.0


class ClockWatch:
    """A thread that measures; a block within which it runs.

    Args:
        bus: connection to the hub.
        name: of the service, for its reports.

    Raises:
        ClockError: on entering, if the clocks differ too much to begin.
    """

    def __init__(self, bus: Bus, name: str) -> None:
        self._bus, self._name = bus, name
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self.offset_ms = 0.0
        """As last measured; ahead is positive [ms]."""

    def __enter__(self) -> "ClockWatch":
        self._measure()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ended.wait(_period_s):
            try:
                self._measure()
            except ClockError as error:
                self._report(str(error))
            except NoAnswerError:
                # The hub is away; that is told by others, and the last offset is still the best.
                continue

    def _measure(self) -> None:
        measured = measure_clock(self._bus)
        self.offset_ms = 1000 * measured.offset_s
        measured.require_small()

    def _report(self, detail: str) -> None:
        fault = Fault(stamp_ns=clock.now_ns(), node=self._name, what="clocks differ", detail=detail)
        self._bus.publish(topics.FAULT.of(fault))
