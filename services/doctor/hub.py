"""How a hub on another machine sees this one. What its rules refuse is refused without a word."""

from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

from schemas.errors import MissingComponentError, UserError
from schemas.fleet import Access
from schemas.health import ServiceState, SystemStatus
from services.doctor.checks import Check
from services.process_table import process_named
from services.roles import ROLES, role_named
from services.runtime.client import Client
from services.runtime.identity import Identity, IdentityError
from services.runtime.joining import (
    ClockError,
    ClockOffset,
    NotAllowedError,
    require_access_for,
)
from services.runtime.link import EndpointError, Link

_soon_days = 30
_problems = (UserError, MissingComponentError)


def check_hub(endpoint: str, folder: Path | None, realm: str) -> list[Check]:
    """Certificate, way to the hub, rights, clock, and who is there."""
    checks: list[Check] = []
    try:
        link = Link.to(endpoint, folder)
        if link.identity is not None:
            checks.append(check_certificate(link.identity))
        with Client(realm, link) as client:
            run = client.info.run
            checks.append(_good("hub", f"{endpoint} runs {run.robot} in realm {run.realm}"))
            access, offset, status = client.access(), client.clock_offset(), client.status()
    except (IdentityError, EndpointError) as error:
        return [*checks, _bad("identity", str(error), "give --tls the folder of one role")]
    except _problems as error:
        return [*checks, _bad("hub", str(error), "see deploy/README.md")]
    return [*checks, check_access(access), check_clock(offset), check_services(status)]


def check_certificate(identity: Identity) -> Check:
    """How long it is still good."""
    days = (identity.ends - datetime.now(UTC)).days
    detail = f"role {identity.name}, expires {identity.ends:%Y-%m-%d}"
    if days < _soon_days:
        return _bad("identity", detail, "'incognita certs make DIR --renew' and carry it here")
    return _good("identity", detail)


def check_access(access: Access) -> Check:
    """Whether the hub lets the role do what its services need; its rules may be of another day."""
    if access.role not in [role.name for role in ROLES]:
        return _good("access", f"{access.role}: everything")
    role = role_named(access.role)
    try:
        for name in role.services:
            require_access_for(process_named(name), access)
    except NotAllowedError as error:
        return _bad("access", str(error), "run the same version of Incognita on both machines")
    says = ", ".join(access.publishes) or "nothing"
    hears = ", ".join(access.listens) or "nothing"
    return _good("access", f"role {role.name} may publish {says}; may hear {hears}")


def check_clock(offset: ClockOffset) -> Check:
    """Whether the clocks agree well enough."""
    try:
        offset.require_small()
    except ClockError as error:
        return _bad("clock", str(error), "let chrony or systemd-timesyncd set both clocks")
    millis, half = 1000 * offset.offset_s, 1000 * offset.uncertainty_s
    return _good("clock", f"{millis:+.1f} ms to the hub's, known to {half:.1f} ms")


def check_services(status: SystemStatus) -> Check:
    """Whether every machine does its part."""
    missing = _names(status, (ServiceState.RUNNING,))
    if missing:
        remedy = "start 'incognita service --connect ... --tls DIR/ROLE' on their machines"
        return _bad("services", f"not running: {', '.join(missing)}", remedy)
    return _good("services", f"{len(status.services)} are running")


def _names(status: SystemStatus, good: Iterable[ServiceState]) -> list[str]:
    return [row.name for row in status.services if row.state not in good]


def _good(name: str, detail: str) -> Check:
    return Check(name=name, ok=True, detail=detail)


def _bad(name: str, detail: str, remedy: str) -> Check:
    return Check(name=name, ok=False, detail=detail, remedy=remedy)
