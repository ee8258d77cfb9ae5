"""Certificates: who can read what, what they are good for, and until when."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID

from schemas.errors import MissingComponentError, UserError
from services.cli import main
from services.roles import ROLES
from services.runtime.certificates import identities, make, renew, revoke
from services.runtime.identity import Identity

names = ["hub", *(role.name for role in ROLES)]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    make(tmp_path / "certs", ["robot.local", "10.0.0.1"], days=30)
    return tmp_path / "certs"


def certificate(folder: Path, name: str) -> x509.Certificate:
    return x509.load_pem_x509_certificate((folder / name / "cert.pem").read_bytes())


def authority(folder: Path, name: str = "authority") -> x509.Certificate:
    return x509.load_pem_x509_certificate((folder / name / "ca.pem").read_bytes())


def test_nobody_else_can_read_a_key_or_look_into_a_folder(folder: Path) -> None:
    for name in (*names, "authority"):
        assert (folder / name / "key.pem").stat().st_mode & 0o777 == 0o600
        assert (folder / name).stat().st_mode & 0o777 == 0o700


def test_every_machine_gets_all_it_needs_and_not_the_authoritys_key(folder: Path) -> None:
    for name in names:
        held = sorted(path.name for path in (folder / name).iterdir())
        assert held == ["ca.pem", "cert.pem", "key.pem"]
        certificate(folder, name).verify_directly_issued_by(authority(folder, name))
        assert Identity.read(folder / name).name == name


def test_a_role_cannot_pretend_to_be_a_hub_nor_issue_certificates(folder: Path) -> None:
    for name in names:
        issued = certificate(folder, name)
        purposes = list(issued.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value)
        wanted = (
            ExtendedKeyUsageOID.SERVER_AUTH if name == "hub" else ExtendedKeyUsageOID.CLIENT_AUTH
        )
        assert purposes == [wanted]
        assert not issued.extensions.get_extension_for_class(x509.BasicConstraints).value.ca


def test_the_hub_is_known_by_the_names_given_and_as_this_machine(folder: Path) -> None:
    assert set(Identity.read(folder / "hub").hosts) >= {"robot.local", "10.0.0.1", "127.0.0.1"}
    assert Identity.read(folder / "viewer").hosts == ()


def test_they_expire_when_it_was_said(folder: Path) -> None:
    for issued in identities(folder):
        assert abs(issued.ends - datetime.now(UTC) - timedelta(days=30)) < timedelta(minutes=5)


def test_an_expired_one_is_refused_in_words(tmp_path: Path) -> None:
    make(tmp_path / "old", [], days=0)
    with pytest.raises(MissingComponentError, match=r"viewer expired on .*--renew"):
        Identity.read(tmp_path / "old" / "viewer").require_valid()


def test_renewed_ones_are_of_the_same_authority_and_keep_the_hosts(folder: Path) -> None:
    before = certificate(folder, "viewer")
    renew(folder, [], days=60)
    after = certificate(folder, "viewer")
    assert after.serial_number != before.serial_number
    before.verify_directly_issued_by(authority(folder))
    assert "robot.local" in Identity.read(folder / "hub").hosts


def test_after_a_revocation_the_old_ones_are_strangers(folder: Path) -> None:
    before = certificate(folder, "viewer")
    revoke(folder, [], days=60)
    assert authority(folder).subject != before.issuer
    key = authority(folder).public_key()
    assert isinstance(key, ec.EllipticCurvePublicKey)
    with pytest.raises(ValueError, match="Issuer"):
        before.verify_directly_issued_by(authority(folder))
    assert "robot.local" in Identity.read(folder / "hub").hosts


def test_what_there_is_is_not_overwritten_unasked(folder: Path) -> None:
    with pytest.raises(UserError, match="--renew"):
        make(folder, [], days=1)


def test_a_key_that_others_can_read_is_refused(folder: Path) -> None:
    (folder / "viewer" / "key.pem").chmod(0o644)
    with pytest.raises(UserError, match="chmod 600"):
        Identity.read(folder / "viewer")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["certs", "show", "/nowhere"], ["/nowhere", "certs make"]),
        (["certs", "make", "/tmp/x", "--days", "0"], ["--days"]),
        (["certs", "make", "/tmp/x", "--renew", "--revoke"], ["--renew", "--revoke"]),
        (["certs", "make", "/nowhere", "--renew"], ["certs make"]),
        (["hub", "--listen", "tcp/0.0.0.0:7447"], ["open to everybody", "tls/"]),
        (["hub", "--listen", "tls/0.0.0.0:7447"], ["--tls"]),
        (["hub", "--role", "driver"], ["driver", "compute"]),
        (["service", "--connect", "tls/robot:7447"], ["--tls"]),
        (["service", "mapping", "--connect", "tcp/10.0.0.1:7447"], ["open to everybody"]),
        (["status", "--tls", "/nowhere"], ["--connect"]),
        (["status", "--connect", "tls/a:1", "--tls", "/nowhere"], ["/nowhere", "ca.pem"]),
    ],
)
def test_errors_are_one_line_that_helps(
    arguments: list[str], words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len([line for line in said if line.startswith("incognita: ")]) == 1
    for word in words:
        assert word in said[-1]
