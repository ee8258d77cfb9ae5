"""The order of messages: what comes twice or too late is not heard again."""

_confirming = 10
"""So many in a row, each after the other, are a clock that was set back, not stragglers."""


class Timeline:
    """Stamps of one topic."""

    def __init__(self) -> None:
        self.last_ns: int | None = None
        self._straggler_ns = 0
        self._stragglers = 0

    def flaw_of(self, stamp_ns: int) -> str:
        """Why a message of this stamp is not the next one, "" if it is."""
        if self.last_ns is None or stamp_ns > self.last_ns:
            self.last_ns, self._stragglers = stamp_ns, 0
            return ""
        late_s = (self.last_ns - stamp_ns) / 1e9
        if late_s == 0:
            return "it came twice"
        going_on = self._stragglers > 0 and stamp_ns > self._straggler_ns
        self._stragglers = self._stragglers + 1 if going_on else 1
        self._straggler_ns = stamp_ns
        if self._stragglers < _confirming:
            return f"it is {late_s:.3g} s older than the last one"
        self.last_ns, self._stragglers = stamp_ns, 0
        return ""
