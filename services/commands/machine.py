"""Verbs about this machine and this checkout."""


def doctor(fix: bool = False, json: bool = False) -> int:
    """What this machine has and lacks, and how to mend it.

    Args:
        fix: mend what can be mended.
        json: one JSON document on stdout.
    """
    from services.doctor.checks import run_doctor

    return run_doctor(fix, json)


def test(arguments: list[str]) -> int:
    """Run every check and test; arguments go to pytest."""
    from services.testing import run_tests

    return run_tests(arguments)
