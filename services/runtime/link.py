"""How to reach a hub, and where a hub may be reached: plain on this machine, mutual TLS beyond."""

import ipaddress
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from schemas.errors import UserError
from services.runtime.access import LOCAL_PROTOCOL, access_control

if TYPE_CHECKING:
    from services.runtime.identity import Identity

PORT = 7447
_forms = "tls/HOST:PORT, tcp/127.0.0.1:PORT or unixsock-stream/PATH"


class EndpointError(UserError):
    """An endpoint that is none, or that would be open to others; the text says what is allowed."""


@dataclass(frozen=True)
class Link:
    """A hub's endpoint, and as whom one connects."""

    endpoint: str
    identity: "Identity | None" = None

    def __post_init__(self) -> None:
        require_private(self.endpoint)
        if is_encrypted(self.endpoint) != (self.identity is not None):
            raise EndpointError(
                f"{self.endpoint}: tls/ needs --tls DIR with this machine's certificate"
                if self.identity is None
                else f"{self.endpoint}: a certificate goes with tls/HOST:PORT alone"
            )

    @classmethod
    def to(cls, endpoint: str, folder: Path | None = None) -> "Link":
        """A link as whom a folder of `certs make` says.

        Raises:
            IdentityError: no usable certificate there.
            EndpointError: the endpoint is none, or a certificate is missing or of no use.
        """
        return cls(endpoint, read_identity(folder) if folder else None)

    def settings(self) -> dict[str, Any]:
        """Zenoh's settings for it.

        Raises:
            ExpiredError: the certificate is not valid now.
        """
        if self.identity is None:
            return {}
        self.identity.require_valid()
        return {
            **_tls(self.identity),
            "transport/link/tls/connect_certificate": self.identity.certificate,
            "transport/link/tls/connect_private_key": self.identity.key,
        }

    def why_not(self) -> str:
        """What to look at when a connection fails: a refused handshake gives no reason."""
        if self.identity is None:
            return ""
        return (
            f". Is a hub there, is {_host(self.endpoint)} one of the names in its certificate "
            f"('incognita certs show DIR'), and is {self.identity.folder} of the same authority?"
        )


@dataclass(frozen=True)
class Listen:
    """Where a hub listens, and as whom."""

    endpoints: tuple[str, ...]
    identity: "Identity | None" = None

    def __post_init__(self) -> None:
        for endpoint in self.endpoints:
            require_private(endpoint)
            if is_encrypted(endpoint) and self.identity is None:
                raise EndpointError(f"{endpoint}: tls/ needs --tls DIR with the hub's certificate")

    def settings(self, realm: str, robot: str) -> Mapping[str, Any]:
        """Zenoh's settings for it: with certificates come rules about who may do what.

        Raises:
            ExpiredError: the certificate is not valid now.
        """
        if self.identity is None:
            return {}
        self.identity.require_valid()
        return {
            **_tls(self.identity),
            "transport/link/tls/listen_certificate": self.identity.certificate,
            "transport/link/tls/listen_private_key": self.identity.key,
            "access_control": access_control(realm, robot),
        }


def read_identity(folder: Path) -> "Identity":
    """The identity in a folder.

    Raises:
        IdentityError: no usable certificate there.
    """
    # Here, because without certificates nothing is to wait for what reads them.
    from services.runtime.identity import Identity  # noqa: PLC0415

    return Identity.read(folder)


def is_encrypted(endpoint: str) -> bool:
    """Whether the link is TLS."""
    return endpoint.startswith("tls/")


def require_private(endpoint: str) -> None:
    """Refuse what others could read or write to.

    Raises:
        EndpointError: neither on this machine nor encrypted.
    """
    protocol, _, address = endpoint.partition("/")
    if not address:
        raise EndpointError(f"endpoint {endpoint!r}: use {_forms}")
    if protocol in ("tls", LOCAL_PROTOCOL):
        return
    if protocol != "tcp" or not _is_loopback(_host(endpoint)):
        raise EndpointError(
            f"endpoint {endpoint!r} would be open to everybody; use {_forms}, "
            "and 'incognita certs make DIR' for tls"
        )


def _host(endpoint: str) -> str:
    return endpoint.partition("/")[2].rpartition(":")[0].strip("[]")


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _tls(identity: "Identity") -> dict[str, Any]:
    return {
        "transport/link/tls/root_ca_certificate": identity.authority,
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/verify_name_on_connect": True,
        "transport/link/tls/close_link_on_expiration": True,
    }
