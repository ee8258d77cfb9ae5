"""Verbs about this machine and this checkout."""

from pathlib import Path

from schemas.errors import UserError


def doctor(
    fix: bool = False,
    json: bool = False,
    connect: str | None = None,
    tls: Path | None = None,
    realm: str = "default",
) -> int:
    """What this machine has and lacks, and how to mend it.

    Args:
        fix: mend what can be mended.
        json: one JSON document on stdout.
        connect: endpoint of a hub on another machine; then only what concerns it is looked at:
            the certificate, the way, what the hub's rules allow, the clocks, who is there.
        tls: folder of this machine's certificate, with --connect.
        realm: of the system behind that hub.
    """
    if connect is not None:
        from services.doctor.checks import tell
        from services.doctor.hub import check_hub

        return tell(check_hub(connect, tls, realm), json)
    if tls is not None:
        raise UserError("--tls goes with --connect tls/HOST:PORT")
    from services.doctor.checks import run_doctor

    return run_doctor(fix, json)


def test(arguments: list[str]) -> int:
    """Run every check and test; arguments go to pytest."""
    from services.testing import run_tests

    return run_tests(arguments)
