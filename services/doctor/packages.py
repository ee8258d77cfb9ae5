"""The installed packages beside those of a lock file."""

from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement


def locked(lock: Path) -> dict[str, str]:
    """Version of every package that the lock file has for this machine, by name."""
    return {r.name: next(iter(r.specifier)).version for r in _requirements(lock)}


def differences(lock: Path) -> list[str]:
    """What is installed otherwise than locked, such as "numpy 2.0.0 (locked 2.4.6)"."""
    rows = ((name, installed_version(name), want) for name, want in locked(lock).items())
    return [
        f"{name} {have or 'missing'} (locked {want})" for name, have, want in rows if have != want
    ]


def installed_version(name: str) -> str | None:
    """Version of an installed distribution, or None."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _requirements(lock: Path) -> Iterator[Requirement]:
    for text in lock.read_text().splitlines():
        # Lines with hashes are indented and belong to the requirement above them.
        if text[:1].isalnum():
            requirement = Requirement(text.removesuffix("\\").strip())
            if requirement.marker is None or requirement.marker.evaluate():
                yield requirement
