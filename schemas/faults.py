"""What went wrong in a service and was contained, told in words and not too often."""

from dataclasses import dataclass

from schemas.health import Fault

period_ns = 1_000_000_000
"""Of one kind, no more than one report in this time: what is wrong is wrong in every message."""


@dataclass
class _Kind:
    """What waits to be told about one kind of fault."""

    count: int = 0
    detail: str = ""
    """Of the first that waits: what came after may be its consequence."""
    told_ns: int | None = None


class FaultLog:
    """Collects what the core contains; the node takes out what it is time to tell.

    Args:
        node: the process that the reports are about.
    """

    def __init__(self, node: str) -> None:
        self._node = node
        self._kinds: dict[str, _Kind] = {}

    def note(self, what: str, detail: str) -> None:
        """Take down one fault: `what` is short and stable, `detail` says what was wrong."""
        kind = self._kinds.setdefault(what, _Kind())
        kind.detail = kind.detail if kind.count else detail
        kind.count += 1

    def due(self, stamp_ns: int) -> list[Fault]:
        """Reports of all kinds that wait and were not told just before."""
        return [
            self._told(what, kind, stamp_ns)
            for what, kind in self._kinds.items()
            if kind.count and _is_time(kind, stamp_ns)
        ]

    def _told(self, what: str, kind: _Kind, stamp_ns: int) -> Fault:
        detail = kind.detail if kind.count == 1 else f"{kind.detail} ({kind.count} times)"
        kind.count, kind.told_ns = 0, stamp_ns
        return Fault(stamp_ns=stamp_ns, node=self._node, what=what, detail=detail)


def _is_time(kind: _Kind, stamp_ns: int) -> bool:
    # Stamps may go back, which is one of the faults: only the distance counts.
    return kind.told_ns is None or abs(stamp_ns - kind.told_ns) >= period_ns
