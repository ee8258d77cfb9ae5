"""The Vulkan driver that SAPIEN draws with.

A machine with a working driver of its own needs nothing of this. On others the set-up puts a
software driver into `DRIVER_FOLDER`; `activate` makes it effective in the running process.
"""

import ctypes
import os
import subprocess
import sys
import warnings
from pathlib import Path

from schemas.errors import MissingComponentError

DRIVER_FOLDER = Path(sys.prefix) / "share" / "vulkan"
"""Where the set-up puts a driver: `driver.json`, `lib/` and `preload.txt`."""

_MANIFEST = "driver.json"
_PRELOAD = "preload.txt"
_VARIABLES = ("VK_DRIVER_FILES", "VK_ICD_FILENAMES")
_PROBE = """
from sim import vulkan
vulkan.activate()
import sapien
print(sapien.render.get_device_summary())
"""


class NoVulkanDeviceError(MissingComponentError):
    """SAPIEN finds no device that it can draw with."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"{reason}; `incognita doctor --fix` gets a software driver")
        self.reason = reason
        """What went wrong, without the remedy."""


def activate() -> None:
    """Makes the driver found by set-up effective in this process; call it before importing sapien.

    A driver chosen by the user through `VK_DRIVER_FILES` or `VK_ICD_FILENAMES` is left alone, and
    without a driver from set-up the machine's own is used. May be called more than once.

    Raises:
        OSError: a library of the driver does not load.
    """
    # SAPIEN brings a Vulkan loader for machines without one and warns that it uses it.
    warnings.filterwarnings("ignore", message="Failed to find system libvulkan")
    # More threads than one make small pictures slower and take the cores of the other services.
    os.environ.setdefault("LP_NUM_THREADS", "1")
    manifest = DRIVER_FOLDER / _MANIFEST
    if user_driver() or not manifest.exists():
        return
    for name in (DRIVER_FOLDER / _PRELOAD).read_text().split():
        # The dynamic linker takes a library that is loaded already for every later request of its
        # name, so the driver finds its libraries with no search path set before the start.
        ctypes.CDLL(str(DRIVER_FOLDER / "lib" / name))
    for variable in _VARIABLES:
        os.environ[variable] = str(manifest)


def user_driver() -> str | None:
    """The driver that the user chose through the environment, if any.

    Ours stands there too once a parent process has called `activate`, and is no such choice.
    """
    ours = str(DRIVER_FOLDER / _MANIFEST)
    named = (os.environ.get(variable) for variable in _VARIABLES)
    return next((name for name in named if name and name != ours), None)


def device_name() -> str:
    """Name of the device that SAPIEN draws with here, such as "llvmpipe (LLVM 15.0.6, 256 bits)".

    Asks in a child process, because a driver that fails may take its process with it.

    Raises:
        NoVulkanDeviceError: there is none; its reason ends in the driver's own words.
    """
    command = [sys.executable, "-c", _PROBE]
    root = str(Path(__file__).resolve().parents[1])
    environment = os.environ | {"PYTHONPATH": root}
    try:
        probe = subprocess.run(
            command, env=environment, capture_output=True, text=True, timeout=120, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise NoVulkanDeviceError("the Vulkan driver gave no answer within 120 s") from error
    for line in probe.stdout.splitlines():
        if line.startswith("GPU: "):
            return line.removeprefix("GPU: ")
    last_words = (probe.stderr.strip() or f"exit status {probe.returncode}").splitlines()[-1]
    raise NoVulkanDeviceError(f"SAPIEN finds no Vulkan device: {last_words}")
