"""The only place that reads the wall clock for nodes."""

import time


def now_ns() -> int:
    """Nanoseconds since the epoch."""
    return time.time_ns()


class Rate:
    """Due times of something periodic, measured on the monotonic clock."""

    def __init__(self, hertz: float) -> None:
        self.period_s = 1.0 / hertz
        self._due = time.monotonic()

    def wait_s(self) -> float:
        """Time until it is due; 0 when it is due now [s]."""
        return max(0.0, self._due - time.monotonic())

    def due(self) -> bool:
        """True once a period. Periods that were missed are skipped, not caught up."""
        now = time.monotonic()
        if now < self._due:
            return False
        self._due = max(self._due + self.period_s, now)
        return True
