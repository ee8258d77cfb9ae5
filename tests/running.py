"""A whole system as its user starts it, in a realm of its own."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil

from schemas.errors import MissingComponentError
from schemas.health import ServiceHealth, ServiceState, SystemStatus
from services.runtime.client import Client


@dataclass
class Running:
    """One `incognita up` and how to look at it."""

    process: subprocess.Popen[str]
    realm: str
    folder: Path

    def status(self) -> SystemStatus:
        with Client(self.realm) as client:
            return client.status()

    def service(self, name: str) -> ServiceHealth:
        return next(row for row in self.status().services if row.name == name)

    def kill(self, name: str, number: signal.Signals = signal.SIGKILL) -> int:
        pid = self.service(name).pid
        os.kill(pid, number)
        return pid

    def processes(self) -> list[psutil.Process]:
        """The supervisor and every service."""
        return [psutil.Process(self.process.pid)] + [
            psutil.Process(row.pid) for row in self.status().services
        ]

    def wait_until_ready(self, seconds: float = 60.0) -> None:
        eventually(lambda: self.process.poll() is not None or self._ready(), seconds, "ready")
        assert self.process.poll() is None, "ended before it was ready"

    def wait_until_reborn(self, name: str, old_pid: int, seconds: float = 40.0) -> None:
        def reborn() -> bool:
            row = self.service(name)
            return row.pid not in (0, old_pid) and row.state is ServiceState.RUNNING

        eventually(reborn, seconds, f"{name} restarted")

    def _ready(self) -> bool:
        try:
            return self.status().ready
        except MissingComponentError:
            return False


def eventually(condition: Callable[[], bool], seconds: float, what: str) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"{what}: not within {seconds:g} s"
        time.sleep(0.1)


@contextmanager
def started(folder: Path, realm: str, *arguments: str) -> Generator[Running]:
    command = [sys.executable, "-m", "services.cli", "up", "--realm", realm, *arguments]
    root = Path(__file__).parents[1]
    process = subprocess.Popen(
        command,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(root)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        yield Running(process, realm, folder)
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(10)
        finally:
            process.kill()
