"""Mesa's software driver lavapipe from the distribution's archive, without touching the system.

An apt state of its own is filled from the archive that the machine's settings name, its updates
and its backports; the packages are downloaded and unpacked into a folder. This needs no root.
"""

import os
import re
from pathlib import Path

from services.doctor.apt_sources import main_archive
from services.doctor.driver import UnavailableError, find, run, say

OLDEST = "24.3"
"""SAPIEN 3.0.3 finds no device with Mesa 22.3 (no descriptor indexing); 25.0 is known to work."""

X11_PACKAGE = "libx11-6"
"""SAPIEN loads libX11 even where it opens no window, and small systems have none."""

_PACKAGE = "mesa-vulkan-drivers"
_VERSION = re.compile(r"(?:\d+:)?(\d+)\.(\d+)")


class PrivateApt:
    """apt with lists, cache and sources below `folder`, over the system's package status."""

    def __init__(self, folder: Path) -> None:
        self.archives = folder / "cache" / "archives"
        for name in ("state/lists/partial", "cache/archives/partial"):
            (folder / name).mkdir(parents=True, exist_ok=True)
        self._sources = folder / "sources.list"
        self._nothing_installed = folder / "nothing-installed"
        self._options = [
            f"Dir::State={folder}/state",
            "Dir::State::status=/var/lib/dpkg/status",
            f"Dir::Cache={folder}/cache",
            f"Dir::Etc::sourcelist={self._sources}",
            "Dir::Etc::sourceparts=/dev/null",
            "Debug::NoLocking=1",
            "Acquire::Languages=none",
        ]
        if os.geteuid() == 0:
            # apt's own user may have no way into this folder.
            self._options.append("APT::Sandbox::User=root")

    def run(self, program: str, *arguments: str, cwd: Path | None = None) -> str:
        """Standard output of apt-get or apt-cache; raises `UnavailableError`."""
        options = [part for option in self._options for part in ("-o", option)]
        return run([program, *options, *arguments], cwd=cwd)

    def update(self) -> None:
        """Reads the lists of the distribution's archive, its updates and its backports."""
        self._sources.write_text("".join(f"{line}\n" for line in main_archive()))
        try:
            self.run("apt-get", "update")
        except UnavailableError as error:
            # A suite that the mirror lacks fails the command; the others were read all the same.
            say(f"  some package lists are missing ({error})")

    def versions(self, package: str) -> list[tuple[str, str]]:
        """Versions of a package, each with the suite that has it; newest first."""
        rows = [line.split("|") for line in self.run("apt-cache", "madison", package).splitlines()]
        return [
            (row[1].strip(), row[2].split()[1].split("/")[0])
            for row in rows
            if "Packages" in row[2]
        ]

    def download(self, *packages: str, suite: str = "") -> list[Path]:
        """Downloads packages and what they need that this system does not have."""
        options = ["--yes", "--no-install-recommends", "--download-only"]
        if suite:
            options.append(f"--target-release={suite}")
        try:
            self.run("apt-get", *options, "install", *packages)
        except UnavailableError as error:
            # The system's own packages contradict one another: as if nothing were installed.
            say(f"  {error}; downloading all that is needed")
            self._nothing_installed.touch()
            options += ["-o", f"Dir::State::status={self._nothing_installed}"]
            self.run("apt-get", *options, "install", *packages)
        return sorted(self.archives.glob("*.deb"))


def unpack(packages: list[Path], folder: Path) -> None:
    """Unpacks Debian packages into `folder`; raises `UnavailableError`."""
    for package in packages:
        run(["dpkg-deb", "--extract", str(package), str(folder)])


def fetch(work: Path) -> tuple[Path, Path, Path]:
    """Downloads lavapipe below `work`.

    Returns:
        Its description for the Vulkan loader, its library, and where all was unpacked.

    Raises:
        UnavailableError: no apt here, or its archive has no version that is new enough.
    """
    say("  reading the package lists of the distribution, with updates and backports")
    apt = PrivateApt(work / "apt")
    apt.update()
    suite = _suite_with_new_enough(apt.versions(_PACKAGE))
    say(f"  downloading {_PACKAGE} from {suite}")
    packages = apt.download(_PACKAGE, X11_PACKAGE, suite=suite)
    say(f"  unpacking {len(packages)} packages")
    unpacked = work / "mesa"
    unpack(packages, unpacked)
    manifest = find(unpacked, "lvp_icd*.json")
    return manifest, find(unpacked, "libvulkan_lvp.so"), unpacked


def _suite_with_new_enough(versions: list[tuple[str, str]]) -> str:
    for version, suite in versions:
        if _numbers(version) >= _numbers(OLDEST):
            return suite
    found = ", ".join(version for version, _ in versions) or "none"
    raise UnavailableError(f"needs Mesa {OLDEST} or newer; the package archive has: {found}")


def _numbers(version: str) -> tuple[int, int]:
    """Major and minor version, of "25.0.7-2~bpo12+1" for instance (25, 0)."""
    found = _VERSION.match(version)
    return (int(found[1]), int(found[2])) if found else (0, 0)
