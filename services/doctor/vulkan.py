"""Finds a Vulkan driver for the simulator, or gets a software driver for it."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from services.doctor import mesa, swiftshader
from services.doctor.driver import UnavailableError, install, say
from sim import vulkan

REMEDY = (
    "install your graphics card's Vulkan driver or Mesa's mesa-vulkan-drivers "
    f"{mesa.OLDEST} or newer, or name a driver in VK_DRIVER_FILES; then `incognita doctor --fix`"
)
"""What a person can do where every way below is closed."""


class Way(NamedTuple):
    """One way to a software driver."""

    name: str
    fetch: Callable[[Path], tuple[Path, Path, Path]]
    """Downloads into a folder; returns description, library and where all was unpacked."""


WAYS = (
    Way("Mesa lavapipe from the distribution's packages", mesa.fetch),
    Way("SwiftShader from an npm package", swiftshader.fetch_from_npm),
    Way("SwiftShader from the distribution's chromium package", swiftshader.fetch_from_apt),
)
"""Ways to a driver without root, the fastest driver first."""


def ensure_driver() -> bool:
    """Whether there is a driver to draw with, after trying every way to get one."""
    try:
        say(f"Vulkan device: {vulkan.device_name()}")
        return True
    except vulkan.NoVulkanDeviceError as error:
        say(error.reason)
    if chosen := vulkan.user_driver():
        say(f"VK_DRIVER_FILES or VK_ICD_FILENAMES names {chosen}; unset it or name one that works")
        return False
    if any(_succeeds(way) for way in WAYS):
        return True
    say(f"no driver found; what remains: {REMEDY}")
    return False


def _succeeds(way: Way) -> bool:
    say(f"trying {way.name}")
    try:
        with tempfile.TemporaryDirectory(prefix="incognita-vulkan-") as work:
            device = install(*way.fetch(Path(work)))
    except UnavailableError as error:
        say(f"  not this way: {error}")
        return False
    say(f"Vulkan device: {device} (in {vulkan.DRIVER_FOLDER})")
    return True
