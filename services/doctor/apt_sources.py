"""The distribution's own archive, read from the machine's apt settings."""

import platform
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from services.doctor.driver import UnavailableError

SUFFIXES = ("", "-updates", "-backports")
"""Suites beside a release in which newer drivers appear."""


class Source(NamedTuple):
    """One archive of binary packages in apt's settings."""

    uri: str
    suites: list[str]
    components: list[str]
    signed_by: str
    """Path of the keyring; empty where the system's default keys hold."""


def main_archive(settings: Path = Path("/etc/apt"), codename: str | None = None) -> list[str]:
    """Lines of a sources.list: the release's archive, its updates and its backports.

    Args:
        settings: apt's folder with `sources.list` and `sources.list.d`.
        codename: the release, such as "bookworm"; this machine's own if not given.

    Raises:
        UnavailableError: the settings name no archive of the release.
    """
    release = codename or _codename()
    for source in _sources(settings):
        if release in source.suites:
            options = f"[signed-by={source.signed_by}] " if source.signed_by else ""
            ending = " ".join(source.components)
            return [f"deb {options}{source.uri} {release}{suffix} {ending}" for suffix in SUFFIXES]
    raise UnavailableError(f"the settings in {settings} name no archive of {release}")


def _codename() -> str:
    try:
        return platform.freedesktop_os_release()["VERSION_CODENAME"]
    except (OSError, KeyError) as error:
        raise UnavailableError("this is no release of Debian or of its descendants") from error


def _sources(settings: Path) -> Iterator[Source]:
    folder = settings / "sources.list.d"
    for path in sorted(folder.glob("*.sources")):
        for paragraph in path.read_text().split("\n\n"):
            yield from _from_paragraph(paragraph)
    for path in [settings / "sources.list", *sorted(folder.glob("*.list"))]:
        if path.exists():
            for line in path.read_text().splitlines():
                yield from _from_line(line)


def _from_paragraph(paragraph: str) -> Iterator[Source]:
    """The entry of a paragraph in the format of deb822."""
    lines = [line for line in paragraph.splitlines() if not line.startswith("#")]
    pairs = [line.partition(":") for line in lines if line[:1].strip()]
    fields = {name.lower(): value.strip() for name, _, value in pairs}
    wanted = "deb" in fields.get("types", "").split() and fields.get("enabled", "yes") != "no"
    if wanted and fields.get("uris"):
        # A key written into the entry itself has no path to point at; apt's default keys remain.
        keyring = fields.get("signed-by", "")
        yield Source(
            fields["uris"].split()[0],
            fields.get("suites", "").split(),
            fields.get("components", "").split(),
            keyring if keyring.startswith("/") else "",
        )


def _from_line(line: str) -> Iterator[Source]:
    """The entry of a line in the classic format, `deb [options] uri suite components`."""
    entry = line.partition("#")[0].strip()
    if not entry.startswith("deb "):
        return
    options, rest = "", entry.removeprefix("deb ").strip()
    if rest.startswith("["):
        options, _, rest = rest[1:].partition("]")
    words = rest.split()
    keyrings = [word.partition("=")[2] for word in options.split() if word.startswith("signed-by=")]
    if len(words) > 1:
        yield Source(words[0], [words[1]], words[2:], "".join(keyrings))
