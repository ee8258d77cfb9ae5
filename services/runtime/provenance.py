"""What a log must say about where it came from."""

import hashlib
import os
import platform
import subprocess
from collections.abc import Mapping
from pathlib import Path

import msgspec

from schemas.run import RunConfig

_root = Path(__file__).resolve().parents[2]


def run_metadata(run: RunConfig) -> Mapping[str, Mapping[str, str]]:
    """Metadata records of a run: its settings, the code, the weights, the machine."""
    settings = {
        name: value if isinstance(value, str) else msgspec.json.encode(value).decode()
        for name, value in msgspec.to_builtins(run).items()
        if name != "web_token"
    }
    return {
        "run": settings,
        "code": {"git": git_revision()},
        "weights": weight_hashes() | {file: _sha256(Path(file)) for file in run.detectors},
        "machine": {"description": machine_description()},
    }


def git_revision() -> str:
    """Short revision of the checkout, with "+" when it was changed; "unknown" without git."""
    try:
        described = subprocess.run(
            ["git", "-C", str(_root), "describe", "--always", "--dirty=+", "--abbrev=7"],
            capture_output=True,
            text=True,
            check=True,
            timeout=5,
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return described.stdout.strip()


def weight_hashes() -> dict[str, str]:
    """SHA-256 of every file of learned weights."""
    files = sorted((_root / "services").glob("*/weights/*"))
    return {str(path.relative_to(_root)): _sha256(path) for path in files if path.is_file()}


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def machine_description() -> str:
    """Cores and system, as printed beside figures."""
    return f"{os.cpu_count()} cores, {platform.machine()}, {platform.system()}"
