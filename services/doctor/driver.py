"""Puts an unpacked Vulkan driver where `sim.vulkan.activate` finds it."""

import ctypes
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from sim import vulkan

_NOT_FOUND = re.compile(r"(\S+): cannot open shared object file")


class UnavailableError(Exception):
    """A way to a driver is closed on this machine; the message says why."""


def say(text: str) -> None:
    """Reports progress on the error stream, where it mixes with no result."""
    print(f"incognita: {text}", file=sys.stderr, flush=True)


def run(command: list[str], cwd: Path | None = None) -> str:
    """Standard output of a command.

    Raises:
        UnavailableError: the command is missing or fails; the message has its last words.
    """
    try:
        done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    except FileNotFoundError as error:
        raise UnavailableError(f"{command[0]} is not installed") from error
    if done.returncode != 0:
        words = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()[-1]
        raise UnavailableError(f"{command[0]} failed: {words}")
    return done.stdout


def find(folder: Path, name: str) -> Path:
    """The file of that name anywhere below `folder`.

    Raises:
        UnavailableError: there is none.
    """
    for path in sorted(folder.rglob(name)):
        return path
    raise UnavailableError(f"the downloaded package holds no {name}")


def libraries_to_load(driver: Path, unpacked: Path) -> list[Path]:
    """The libraries that this machine lacks, each after those it needs, and last the driver.

    What the machine has is preferred to what was unpacked. Loads all of them into this process.

    Raises:
        UnavailableError: something is neither on the machine nor below `unpacked`.
    """
    try:
        ctypes.CDLL(str(driver))
    except OSError as error:
        missing = _NOT_FOUND.search(str(error))
        if missing is None:
            raise UnavailableError(str(error)) from error
        needed = libraries_to_load(find(unpacked, missing[1]), unpacked)
        return needed + libraries_to_load(driver, unpacked)
    return [driver]


def install(manifest: Path, driver: Path, unpacked: Path) -> str:
    """Makes an unpacked driver the one that `sim.vulkan.activate` uses.

    Args:
        manifest: the driver's JSON description for the Vulkan loader.
        driver: its shared library.
        unpacked: where the libraries it needs were unpacked.

    Returns:
        Name of the device that SAPIEN draws with now.

    Raises:
        UnavailableError: a library is nowhere, or SAPIEN finds no device with this driver.
    """
    libraries = libraries_to_load(driver, unpacked)
    while True:
        _lay_down(json.loads(manifest.read_text()), driver, libraries)
        try:
            return vulkan.device_name()
        except vulkan.NoVulkanDeviceError as error:
            shutil.rmtree(vulkan.DRIVER_FOLDER)
            # SAPIEN itself needs libX11, even where it opens no window.
            missing = _NOT_FOUND.search(error.reason)
            if missing is None or missing[1] in (library.name for library in libraries):
                raise UnavailableError(error.reason) from error
            libraries += libraries_to_load(find(unpacked, missing[1]), unpacked)


def _lay_down(description: Any, driver: Path, libraries: list[Path]) -> None:
    """Writes the driver's folder anew; an interruption leaves the old one or none."""
    description["ICD"]["library_path"] = f"./lib/{driver.name}"
    target = vulkan.DRIVER_FOLDER
    fresh = target.with_name(f"{target.name}.new")
    shutil.rmtree(fresh, ignore_errors=True)
    (fresh / "lib").mkdir(parents=True)
    for library in libraries:
        shutil.copy(library, fresh / "lib" / library.name)
    (fresh / "preload.txt").write_text("".join(f"{library.name}\n" for library in libraries))
    (fresh / "driver.json").write_text(json.dumps(description, indent=2) + "\n")
    shutil.rmtree(target, ignore_errors=True)
    fresh.rename(target)
