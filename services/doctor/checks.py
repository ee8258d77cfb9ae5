"""What this machine has and lacks, one line each, and how to mend it."""

import importlib.util
import json
import shutil
import socket
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from services.doctor import packages
from services.doctor.vulkan import REMEDY, ensure_driver
from sim import vulkan

NEEDED_MISSING = 5
"""Exit code of the command line for a needed component that is missing."""

_ROOT = Path(__file__).resolve().parents[2]
_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_FREE_SPACE_NEEDED = 2 * 2**30
_REINSTALL = "remove the folder .venv and run ./incognita again"


@dataclass(frozen=True, kw_only=True)
class Check:
    """One thing looked at on this machine."""

    name: str
    ok: bool
    detail: str
    """What was found, or what is missing."""
    remedy: str = ""
    """How to mend it; empty where nothing needs mending."""
    needed: bool = True
    """Whether Incognita does not work as a whole without it."""


def training_remedy() -> str:
    """How to get the packages that only `incognita train detector` needs."""
    # By name and not as `.[train]`: an installation of the project would resolve dependencies.
    return f"{sys.executable} -m pip install torch onnx (several GB)"


def check_python() -> Check:
    """The running Python against the versions that the lock covers."""
    version = ".".join(str(part) for part in sys.version_info[:3])
    ok = (3, 11) <= sys.version_info < (3, 15)
    return Check(
        name="Python", ok=ok, detail=version, remedy="" if ok else "use Python 3.11 to 3.14"
    )


def check_packages(lock: Path = _ROOT / "requirements.lock") -> Check:
    """The installed packages against the lock file."""
    if not lock.exists():
        return Check(name="packages", ok=True, detail="installed without a lock file")
    wrong = packages.differences(lock)
    count = len(packages.locked(lock))
    detail = "; ".join(wrong) or f"{count} as locked"
    return Check(name="packages", ok=not wrong, detail=detail, remedy=_REINSTALL if wrong else "")


def check_opencv() -> Check:
    """Absence of the distribution that overwrites the headless one."""
    version = packages.installed_version("opencv-python")
    if version is None:
        return Check(name="opencv", ok=True, detail="the headless build alone")
    detail = f"opencv-python {version} overwrites opencv-python-headless"
    return Check(name="opencv", ok=False, detail=detail, remedy=_REINSTALL)


def check_vulkan() -> Check:
    """A device that SAPIEN can draw with."""
    try:
        return Check(name="Vulkan", ok=True, detail=vulkan.device_name())
    except vulkan.NoVulkanDeviceError as error:
        return Check(name="Vulkan", ok=False, detail=error.reason, remedy=REMEDY)


def check_weights() -> Check:
    """The detector's weights, which are part of the tree."""
    path = _ROOT / "services" / "perception" / "weights" / "detector.onnx"
    if path.exists():
        return Check(name="detector", ok=True, detail=f"{path.stat().st_size / 1e6:.1f} MB")
    remedy = "restore the file from git, or run `incognita train detector`"
    return Check(name="detector", ok=False, detail=f"no {path}", remedy=remedy)


def check_disk(folder: Path = Path("runs")) -> Check:
    """Room and permission for the logs of runs, which go to `folder`."""
    place = next(p for p in (folder.absolute(), *folder.absolute().parents) if p.exists())
    free = shutil.disk_usage(place).free
    detail = f"{free / 1e9:.0f} GB free for {folder}/"
    if free < _FREE_SPACE_NEEDED:
        return Check(name="disk", ok=False, detail=detail, remedy="free at least 2 GB")
    if not _is_writable(place):
        remedy = f"make {place} writable, or start in another folder"
        return Check(name="disk", ok=False, detail=f"{place} is read-only", remedy=remedy)
    return Check(name="disk", ok=True, detail=detail)


def _is_writable(folder: Path) -> bool:
    probe = folder / ".incognita-write-test"
    try:
        probe.touch()
        probe.unlink()
    except OSError:
        return False
    return True


def check_loopback() -> Check:
    """A free port on this machine's loopback, for the page and between the services."""
    try:
        with socket.create_server(("127.0.0.1", 0)) as server:
            port: int = server.getsockname()[1]
    except OSError as error:
        remedy = "allow local TCP sockets for this user"
        return Check(name="loopback", ok=False, detail=str(error), remedy=remedy)
    return Check(name="loopback", ok=True, detail=f"port {port} is free")


def check_browser() -> Check:
    """A browser for the tests of the page."""
    found = next(filter(None, map(shutil.which, _BROWSERS)), None)
    remedy = "" if found else "install chromium if you want to run the tests of the page"
    detail = found or "no chromium for the tests of the page"
    return Check(name="browser", ok=bool(found), detail=detail, remedy=remedy, needed=False)


def check_training() -> Check:
    """The packages for training the detector, which are no part of the lock."""
    missing = [name for name in ("torch", "onnx") if importlib.util.find_spec(name) is None]
    if not missing:
        return Check(name="training", ok=True, detail="torch and onnx are here", needed=False)
    detail = f"no {' and no '.join(missing)}, for `incognita train detector` alone"
    remedy = training_remedy()
    return Check(name="training", ok=False, detail=detail, remedy=remedy, needed=False)


CHECKS: tuple[Callable[[], Check], ...] = (
    check_python,
    check_packages,
    check_opencv,
    check_vulkan,
    check_weights,
    check_disk,
    check_loopback,
    check_browser,
    check_training,
)


def line(check: Check) -> str:
    """A check as one line for people."""
    state = "ok" if check.ok else "MISSING" if check.needed else "optional"
    return f"{state:<8}  {check.name:<8}  {check.detail}" + (
        f"; {check.remedy}" if check.remedy else ""
    )


def run_doctor(fix: bool, as_json: bool) -> int:
    """Prints every check on standard output.

    Args:
        fix: first mend what can be mended from here, which is the Vulkan driver.
        as_json: one JSON document, not lines.

    Returns:
        The exit code: 0, or 5 if something needed is missing.
    """
    if fix:
        ensure_driver()
    return tell([check() for check in CHECKS], as_json)


def tell(checks: Sequence[Check], as_json: bool) -> int:
    """Prints checks on standard output.

    Returns:
        The exit code: 0, or 5 if something needed is missing.
    """
    healthy = all(check.ok for check in checks if check.needed)
    if as_json:
        print(json.dumps({"ok": healthy, "checks": [asdict(check) for check in checks]}))
    else:
        print("\n".join(map(line, checks)))
    return 0 if healthy else NEEDED_MISSING
