"""Runs every check and test, after preparing the environment that they need."""

import hashlib
import importlib.util
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

_ROOT = Path(__file__).resolve().parents[1]
_LOCK = _ROOT / "requirements-test.lock"
_STAMP = Path(sys.prefix) / "incognita-test.stamp"
_INSTALL = ("install", "--no-deps", "--require-hashes", "--only-binary", ":all:", "-r", str(_LOCK))


class Step(NamedTuple):
    """One tool of the checks."""

    name: str
    command: tuple[str, ...]
    """Program in the environment's folder of programs, and its arguments."""


PYTEST = Step("pytest", ("pytest",))
STEPS = (
    Step("ruff check", ("ruff", "check", ".")),
    Step("ruff format", ("ruff", "format", "--check", ".")),
    Step("pyright", ("pyright",)),
    Step("import contracts", ("lint-imports",)),
    PYTEST,
)
"""Everything that has to pass before a change lands, the fastest first."""


def run_tests(arguments: Sequence[str] = ()) -> int:
    """Runs every step, or pytest alone if it is given arguments.

    Returns:
        The exit code: 0 if every step passed, 1 if one failed, 5 without the tools for them.
    """
    if not _prepare():
        return 5
    if arguments:
        return _run(PYTEST, arguments)
    failed = [step.name for step in STEPS if _run(step) != 0]
    _say(f"failed: {', '.join(failed)}" if failed else "every check and test passed")
    return 1 if failed else 0


def _prepare() -> bool:
    """Installs the locked test packages if their lock changed since the last time."""
    fingerprint = hashlib.sha256(_LOCK.read_bytes()).hexdigest()
    if _STAMP.exists() and _STAMP.read_text() == fingerprint:
        return True
    _say("first use: installing the packages for tests (about 100 MB)")
    if _install() != 0:
        _say("could not install them; run this again once a package index can be reached")
        return False
    _STAMP.write_text(fingerprint)
    return True


def _install() -> int:
    if importlib.util.find_spec("pip") is None:
        # An environment made by hand with uv has none.
        subprocess.run([sys.executable, "-m", "ensurepip"], stdout=sys.stderr, check=True)
    command = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *_INSTALL]
    return subprocess.run(command, stdout=sys.stderr, check=False).returncode


def _run(step: Step, arguments: Sequence[str] = ()) -> int:
    programs = Path(sys.executable).parent
    _say(step.name)
    # The tools start one another and Python by name.
    search = os.pathsep.join((str(programs), os.environ.get("PATH", os.defpath)))
    command = [str(programs / step.command[0]), *step.command[1:], *arguments]
    done = subprocess.run(command, cwd=_ROOT, env=os.environ | {"PATH": search}, check=False)
    return done.returncode


def _say(text: str) -> None:
    print(f"incognita test: {text}", file=sys.stderr, flush=True)
