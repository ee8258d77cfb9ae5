"""From `incognita up` to the line that says it is ready, beside importing what it needs."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.benchmarks.rows import Row, compared

PEER = "import numpy, cv2, zenoh, gtsam, sapien"

_root = Path(__file__).parents[2]
_drift = 3.0
_patience_s = 10.0


def measure(rounds: int) -> list[Row]:
    """Needs a Vulkan device."""
    names = {"up without page": ("--no-web",), "up with page": ()}
    spent: dict[str, list[float]] = {name: [] for name in (*names, PEER)}
    for _ in range(rounds):
        spent[PEER].append(_import_s())
        for name, options in names.items():
            spent[name].append(_ready_s(*options))
        # Once more at the other end: the load may have changed meanwhile.
        spent[PEER].append(_import_s())
    imports = np.array(spent[PEER])
    return [
        compared(name, "time to ready", "s", np.array(spent[name]), (PEER, imports), drift=_drift)
        for name in names
    ]


def _import_s() -> float:
    started = time.perf_counter()
    subprocess.run([sys.executable, "-c", PEER], check=True, capture_output=True)
    return time.perf_counter() - started


def _ready_s(*options: str) -> float:
    """Start a system in a realm and folder of its own, wait for its line, end it [s]."""
    with TemporaryDirectory(prefix="bench-") as folder:
        started = time.perf_counter()
        system = subprocess.Popen(
            [
                *(sys.executable, "-m", "services.cli", "up", "--no-record"),
                *("--realm", f"bench-{os.getpid()}", *options),
            ],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(_root)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert system.stdout is not None
        try:
            said = list(_until_ready(system.stdout))
            elapsed = time.perf_counter() - started
            assert said[-1:] == ["ready"], "ended before it was ready:\n" + "".join(said)
        finally:
            system.send_signal(signal.SIGINT)
            try:
                system.wait(_patience_s)
            finally:
                system.kill()
                system.stdout.close()
    return elapsed


def _until_ready(lines: Iterable[str]) -> Iterator[str]:
    """What a system says; the last one is "ready" if it got so far."""
    for line in lines:
        if line.startswith("ready:"):
            yield "ready"
            return
        yield line
