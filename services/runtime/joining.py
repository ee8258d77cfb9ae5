"""What a machine asks the hub before it takes part, and what the hub answers.

Zenoh refuses silently and knows no common time. So who joins asks what it may do and how its clock
differs, and says in words what is wrong before it starts.
"""

import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from schemas import topics
from schemas.errors import MissingComponentError, UserError
from schemas.fleet import (
    Access,
    AccessRequest,
    ClockReading,
    ClockRequest,
    RunRequest,
)
from schemas.run import RunConfig
from schemas.topics import ANY_ROBOT, Topic
from services.process_table import Process
from services.runtime import clock
from services.runtime.access import access_of
from services.runtime.link import Link
from services.runtime.wire import Bus, NoAnswerError

CLOCK_BOUND_S = 0.1
"""Commands expire after half a second, so clocks must agree on far less [s]."""
_readings = 8
_patience_s = 4.0
"""A hub that has just opened its port does not answer yet, and one of whose links was just cut
answers late [s]."""
_never_sent = {topics.TICK.key}


class NotAllowedError(UserError):
    """The hub's rules refuse what is wanted; the text says whose certificate it takes."""


class ClockError(MissingComponentError):
    """This machine's clock differs too much from the hub's."""


@dataclass(frozen=True)
class ClockOffset:
    """How this machine's clock stands to the hub's."""

    offset_s: float
    """This clock minus the hub's."""
    uncertainty_s: float
    """Half the time that question and answer took: the offset is known no better."""

    def require_small(self) -> None:
        """Refuse what is certainly above the bound.

        Raises:
            ClockError: it is.
        """
        if abs(self.offset_s) - self.uncertainty_s > CLOCK_BOUND_S:
            side = "ahead of" if self.offset_s > 0 else "behind"
            raise ClockError(
                f"this machine's clock is {abs(self.offset_s):.3f} s {side} the hub's "
                f"({CLOCK_BOUND_S:g} s are allowed); let chrony or systemd-timesyncd set both"
            )


def receive_newcomers(hub: Bus, run: RunConfig) -> None:
    """Answer what is asked below."""
    # A recorder elsewhere writes where it was started, and a page elsewhere has its own secret.
    log = str(Path("runs", Path(run.log).name)) if run.log else ""
    public = msgspec.structs.replace(run, web_token="", log=log)
    hub.serve(topics.CLOCK, lambda _request: ClockReading(stamp_ns=clock.now_ns()))
    hub.serve(topics.ACCESS, lambda request: access_of(hub.name_of(request.session)))
    # Last, because who joins asks it first.
    hub.serve(topics.RUN, lambda _request: public)


def find_run(link: Link, realm: str, timeout_ms: int = 8000) -> RunConfig:
    """Settings of the run that the hub of a realm is for.

    Raises:
        NoSystemError: no hub at the endpoint, or it does not let us in.
        NotAllowedError: it answers nothing to who has this certificate.
    """
    with Bus.client(link.endpoint, realm, ANY_ROBOT, timeout_ms, link.identity) as bus:
        deadline = time.monotonic() + _patience_s
        while True:
            try:
                return bus.ask(topics.RUN, RunRequest(stamp_ns=clock.now_ns()))
            except NoAnswerError as error:
                if time.monotonic() > deadline:
                    raise NotAllowedError(_silent(link, realm)) from error
                time.sleep(0.1)


def _silent(link: Link, realm: str) -> str:
    name = link.identity.name if link.identity else "nobody"
    return (
        f"the hub at {link.endpoint} answers nothing in realm {realm!r} to {name!r}; "
        "it may be for another realm (--realm), or know no such role"
    )


def ask_access(bus: Bus) -> Access:
    """What the hub lets this connection do.

    Raises:
        NoAnswerError: the hub does not say.
    """
    return bus.ask(topics.ACCESS, AccessRequest(session=bus.session))


def require_access(access: Access, who: str, says: Iterable[str], hears: Iterable[str]) -> None:
    """Hold what is wanted against what is allowed.

    Raises:
        NotAllowedError: the hub would refuse some of it without a word.
    """
    unsaid = sorted(set(says) - set(access.publishes))
    unheard = sorted(set(hears) - set(access.listens))
    if unsaid or unheard:
        missing = [
            *([f"publish {', '.join(unsaid)}"] if unsaid else []),
            *([f"hear {', '.join(unheard)}"] if unheard else []),
        ]
        raise NotAllowedError(
            f"{who}: the hub does not let role {access.role!r} {' nor '.join(missing)}; "
            "connect with the certificate of a role that may (deploy/README.md says which)"
        )


def require_access_for(process: Process, access: Access) -> None:
    """Hold a service's row of the table against what is allowed.

    Raises:
        NotAllowedError: the hub would refuse some of what it needs without a word.
    """
    health = () if process.guest else (topics.HEARTBEAT, topics.FAULT)
    says = (*process.publishes, *health)
    require_access(access, process.name, _keys(says), _keys(process.listens) - _never_sent)


def measure_clock(bus: Bus) -> ClockOffset:
    """Ask the hub for its time, and trust the quickest answer.

    Raises:
        NoAnswerError: the hub does not say.
    """
    return min((_reading(bus) for _ in range(_readings)), key=lambda one: one.uncertainty_s)


def _reading(bus: Bus) -> ClockOffset:
    asked_ns = clock.now_ns()
    reading: ClockReading = bus.ask(topics.CLOCK, ClockRequest(stamp_ns=asked_ns))
    told_ns = clock.now_ns()
    middle_ns = (asked_ns + told_ns) // 2
    return ClockOffset((middle_ns - reading.stamp_ns) / 1e9, (told_ns - asked_ns) / 2e9)


def _keys(some: Iterable[Topic[Any]]) -> set[str]:
    return {topic.key for topic in some}
