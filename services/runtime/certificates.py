"""A small private authority, and a certificate for the hub and for every role.

`DIR/authority` holds the authority and its key: it stays with whoever runs the fleet. Every other
folder of `DIR` is all that one machine needs and goes there as it is. A role's certificate cannot
serve as a hub's, or a viewer could pretend to be one.
"""

import ipaddress
import os
import secrets
import shutil
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from schemas.errors import UserError
from services.roles import HUB, ROLES
from services.runtime.identity import (
    AUTHORITY_FILE,
    CERTIFICATE_FILE,
    KEY_FILE,
    Identity,
    IdentityError,
)

AUTHORITY = "authority"
_always_hosts = ("localhost", "127.0.0.1", "::1")
_authority_days = 3650
_backdated = timedelta(hours=1)
"""A robot's clock may be a little behind that of the machine where this runs."""


class CertificateFolderError(UserError):
    """What is asked for does not fit what is in the folder; the text says what does."""


def make(folder: Path, hosts: Iterable[str], days: int) -> list[Identity]:
    """A new authority, and certificates from it.

    Args:
        folder: where they go; must hold none yet.
        hosts: names and addresses by which others reach the hub.
        days: after so many the certificates expire.

    Raises:
        CertificateFolderError: there are certificates already.
    """
    if (folder / AUTHORITY).exists():
        raise CertificateFolderError(
            f"{folder} holds certificates already: --renew makes new ones that go together with "
            "the old, --revoke makes new ones and all old ones useless"
        )
    _new_authority(folder / AUTHORITY)
    return _issue_all(folder, hosts, days)


def renew(folder: Path, hosts: Iterable[str], days: int) -> list[Identity]:
    """New certificates of the same authority; old ones stay good until they expire.

    Raises:
        CertificateFolderError: there is no authority.
    """
    return _issue_all(folder, _wanted_hosts(folder, hosts), days)


def revoke(folder: Path, hosts: Iterable[str], days: int) -> list[Identity]:
    """A new authority and certificates: whoever holds an old one is a stranger from now on.

    That is, from the hub's next start with its new folder.

    Raises:
        CertificateFolderError: there is no authority to be replaced.
    """
    hosts = _wanted_hosts(folder, hosts)
    shutil.rmtree(folder / AUTHORITY)
    _new_authority(folder / AUTHORITY)
    return _issue_all(folder, hosts, days)


def identities(folder: Path) -> list[Identity]:
    """What has been issued.

    Raises:
        CertificateFolderError: there is no authority.
    """
    _require_authority(folder)
    return [Identity.read(folder / name) for name in _names()]


def _names() -> list[str]:
    return [HUB, *(role.name for role in ROLES)]


def _require_authority(folder: Path) -> None:
    if not (folder / AUTHORITY / KEY_FILE).is_file():
        raise CertificateFolderError(
            f"{folder}: no authority there; 'incognita certs make {folder}' makes one"
        )


def _wanted_hosts(folder: Path, hosts: Iterable[str]) -> list[str]:
    """Those given, or else those of the certificate there is."""
    _require_authority(folder)
    given = list(hosts)
    try:
        return given or list(Identity.read(folder / HUB).hosts)
    except IdentityError:
        return given


def _issue_all(folder: Path, hosts: Iterable[str], days: int) -> list[Identity]:
    reached_by = list(dict.fromkeys((*_always_hosts, *hosts)))
    for name in _names():
        _issue(folder, name, reached_by if name == HUB else [], days)
    return identities(folder)


def _new_authority(folder: Path) -> None:
    key = ec.generate_private_key(ec.SECP256R1())
    # A new authority has a new name: programs find the issuer of a certificate by it.
    name = _named(f"Incognita authority {secrets.token_hex(4)}")
    now = datetime.now(UTC)
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _backdated)
        .not_valid_after(now + timedelta(days=_authority_days))
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    _write(folder, certificate, key, certificate)


def _issue(folder: Path, name: str, hosts: list[str], days: int) -> None:
    authority = x509.load_pem_x509_certificate((folder / AUTHORITY / AUTHORITY_FILE).read_bytes())
    authority_key = serialization.load_pem_private_key(
        (folder / AUTHORITY / KEY_FILE).read_bytes(), password=None
    )
    assert isinstance(authority_key, ec.EllipticCurvePrivateKey)
    key = ec.generate_private_key(ec.SECP256R1())
    now = datetime.now(UTC)
    purpose = ExtendedKeyUsageOID.SERVER_AUTH if hosts else ExtendedKeyUsageOID.CLIENT_AUTH
    builder = (
        x509.CertificateBuilder()
        .subject_name(_named(name))
        .issuer_name(authority.subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _backdated)
        .not_valid_after(min(now + timedelta(days=days), authority.not_valid_after_utc))
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage([purpose]), critical=False)
        .add_extension(
            x509.AuthorityKeyIdentifier.from_issuer_public_key(authority.public_key()),  # pyright: ignore[reportArgumentType]
            critical=False,
        )
    )
    if hosts:
        names = x509.SubjectAlternativeName([_general_name(host) for host in hosts])
        builder = builder.add_extension(names, critical=False)
    _write(folder / name, builder.sign(authority_key, hashes.SHA256()), key, authority)


def _named(common_name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        pass
    try:
        return x509.DNSName(host)
    except ValueError as error:
        raise CertificateFolderError(f"host {host!r}: use a name or an address") from error


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _write(
    folder: Path,
    certificate: x509.Certificate,
    key: ec.EllipticCurvePrivateKey,
    authority: x509.Certificate,
) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    folder.chmod(0o700)
    pem = serialization.Encoding.PEM
    (folder / AUTHORITY_FILE).write_bytes(authority.public_bytes(pem))
    if certificate is not authority:
        (folder / CERTIFICATE_FILE).write_bytes(certificate.public_bytes(pem))
    secret = key.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    (folder / KEY_FILE).unlink(missing_ok=True)
    descriptor = os.open(folder / KEY_FILE, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "wb") as file:
        file.write(secret)
