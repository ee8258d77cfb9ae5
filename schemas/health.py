"""How the processes are."""

from enum import StrEnum

from msgspec import Struct


class Tick(Struct, frozen=True, kw_only=True):
    """Time for a node that must act on its own; the only way time itself enters a node."""

    stamp_ns: int


class Heartbeat(Struct, frozen=True, kw_only=True):
    """Sent from a node's own loop, so that a hung node falls silent."""

    stamp_ns: int
    node: str
    pid: int
    handled: int
    """Messages handled since the process started."""
    busy: float
    """Share of the last second spent in handlers."""
    lost: int
    """Never-drop messages missing by sequence number."""
    replaced: int
    """Latest-wins messages that a newer one replaced."""
    malformed: int
    """Messages that did not decode, or whose handler refused them."""
    handler_ms: float
    """Mean time in a handler over the last second [ms]."""
    host: str = ""
    """Name of the machine that the process runs on."""
    clock_offset_ms: float = 0.0
    """Of that machine's clock against the hub's, as last measured; ahead is positive [ms]."""


class Fault(Struct, frozen=True, kw_only=True):
    """Something went wrong and was contained."""

    stamp_ns: int
    node: str
    what: str
    """Short and stable, to be counted: "malformed message", "handler failed", ..."""
    detail: str


class ServiceState(StrEnum):
    """A service as its supervisor sees it."""

    STARTING = "starting"
    RUNNING = "running"
    HUNG = "hung"
    RESTARTING = "restarting"
    FAILED = "failed"
    STOPPED = "stopped"
    AWAY = "away"
    """Runs on another machine, and is not heard."""


class ServiceHealth(Struct, frozen=True, kw_only=True):
    """One row of `status`."""

    name: str
    state: ServiceState
    pid: int
    restarts: int
    age_s: float
    """Since the last heartbeat; negative before the first [s]."""
    handled: int
    busy: float
    handler_ms: float
    lost: int
    replaced: int
    malformed: int
    detail: str
    host: str = ""
    """Where it runs."""
    clock_offset_ms: float = 0.0
    """Of its machine's clock against the hub's [ms]."""


class SystemStatus(Struct, frozen=True, kw_only=True):
    """The whole system, kept by the supervisor."""

    stamp_ns: int
    realm: str
    robot: str
    world: str
    ready: bool
    services: tuple[ServiceHealth, ...]
    faults: tuple[Fault, ...]
    """Most recent last."""


class StatusRequest(Struct, frozen=True, kw_only=True):
    """Ask for `SystemStatus`."""

    stamp_ns: int
