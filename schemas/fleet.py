"""What machines ask the hub before they take part."""

from msgspec import Struct


class RunRequest(Struct, frozen=True, kw_only=True):
    """Ask for the settings of the run; the reply is a `RunConfig` without its secrets."""

    stamp_ns: int


class ClockRequest(Struct, frozen=True, kw_only=True):
    """Ask for the hub's time."""

    stamp_ns: int


class ClockReading(Struct, frozen=True, kw_only=True):
    """The hub's time at the moment it answered."""

    stamp_ns: int


class AccessRequest(Struct, frozen=True, kw_only=True):
    """Ask what the hub's rules let this connection do; it would never be told otherwise."""

    session: str
    """Number of the asking session, by which the hub finds the certificate it came with."""


class Access(Struct, frozen=True, kw_only=True):
    """What the hub's rules let one connection do."""

    role: str
    """From the certificate; "local" for the hub's own user on the hub's own machine."""
    publishes: tuple[str, ...]
    """Keys of topics."""
    listens: tuple[str, ...]
