"""Who a process is towards the others: the folder of its certificate, as `certs make` wrote it."""

import stat
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from cryptography import x509
from cryptography.x509.oid import NameOID

from schemas.errors import MissingComponentError, UserError

AUTHORITY_FILE, CERTIFICATE_FILE, KEY_FILE = "ca.pem", "cert.pem", "key.pem"
_again = "make new ones with 'incognita certs make DIR --renew'"


class IdentityError(UserError):
    """A folder that holds no usable certificate; the text says why."""


class ExpiredError(MissingComponentError):
    """A certificate whose time is over, or has not come."""


@dataclass(frozen=True)
class Identity:
    """A certificate, its key and the authority that both sides trust."""

    folder: Path
    name: str
    """The role that the certificate is for, or "hub"."""
    begins: datetime
    ends: datetime
    hosts: tuple[str, ...]
    """Names and addresses that a hub may be reached by."""

    @classmethod
    def read(cls, folder: Path) -> "Identity":
        """The identity in a folder; only its owner may be able to read the key.

        Raises:
            IdentityError: a file is missing or broken, or others can read the key.
        """
        for file in (AUTHORITY_FILE, CERTIFICATE_FILE, KEY_FILE):
            if not (folder / file).is_file():
                raise IdentityError(
                    f"{folder}: no {file} there; --tls takes one role's folder, "
                    "as 'incognita certs make DIR' writes it (DIR/compute, DIR/viewer, ...)"
                )
        key = folder / KEY_FILE
        if key.stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO):
            raise IdentityError(f"{key}: others can read this key; 'chmod 600 {key}'")
        certificate = _certificate(folder / CERTIFICATE_FILE)
        return cls(
            folder=folder.resolve(),
            name=_common_name(certificate),
            begins=certificate.not_valid_before_utc,
            ends=certificate.not_valid_after_utc,
            hosts=_hosts(certificate),
        )

    def require_valid(self) -> None:
        """Said here, because a refused handshake says nothing.

        Raises:
            ExpiredError: not valid now.
        """
        now = datetime.now(UTC)
        if now > self.ends:
            raise ExpiredError(
                f"the certificate {self.folder} expired on {self.ends:%Y-%m-%d}; {_again}"
            )
        if now < self.begins:
            raise ExpiredError(
                f"the certificate {self.folder} begins on {self.begins:%Y-%m-%d %H:%M} UTC, "
                f"and this machine's clock says {now:%Y-%m-%d %H:%M}; set the clock"
            )

    @property
    def authority(self) -> str:
        """Path of the authority's certificate."""
        return str(self.folder / AUTHORITY_FILE)

    @property
    def certificate(self) -> str:
        """Path of the certificate."""
        return str(self.folder / CERTIFICATE_FILE)

    @property
    def key(self) -> str:
        """Path of the private key."""
        return str(self.folder / KEY_FILE)


def _certificate(path: Path) -> x509.Certificate:
    try:
        return x509.load_pem_x509_certificate(path.read_bytes())
    except ValueError as error:
        raise IdentityError(f"{path}: no certificate: {error}") from error


def _common_name(certificate: x509.Certificate) -> str:
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if names else ""


def _hosts(certificate: x509.Certificate) -> tuple[str, ...]:
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return ()
    return tuple(str(name.value) for name in names)
