"""Where a running system leaves its socket, its address and its services' output.

One folder a user and realm, closed to everybody else. A lock in it makes a second system in the
same realm impossible; the lock goes with the process that held it, however that ended.
"""

import fcntl
import json
import os
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from schemas.errors import MissingComponentError, UserError
from schemas.run import RunConfig


class RealmTakenError(UserError):
    """Another system runs in this realm; the text says how to stop it."""


class NotRunningError(MissingComponentError):
    """No system runs in this realm."""


class SystemInfo(msgspec.Struct, frozen=True, kw_only=True):
    """How to reach a running system."""

    pid: int
    endpoint: str
    address: str
    """Of the page, with its token; empty without a page."""
    log: str
    """File the run is recorded in; empty when it is not."""
    run: RunConfig
    tls: str = ""
    """Folder with the certificate to connect with; empty on the hub's own machine."""


@dataclass(frozen=True)
class RunDirectory:
    """Files of one realm."""

    path: Path

    @classmethod
    def of(cls, realm: str) -> "RunDirectory":
        """The directory of a realm; created, and closed to other users.

        Raises:
            UserError: the realm is not a plain word.
        """
        if not realm.replace("-", "").replace("_", "").isalnum() or len(realm) > 40:
            raise UserError(
                f"realm {realm!r}: use up to 40 letters, digits, '-' and '_' (one word)"
            )
        path = Path(tempfile.gettempdir()) / f"incognita-{os.getuid()}" / realm
        path.mkdir(parents=True, exist_ok=True)
        path.parent.chmod(0o700)
        if path.parent.stat().st_uid != os.getuid():
            raise UserError(f"{path.parent} belongs to another user")
        return cls(path)

    @property
    def endpoint(self) -> str:
        """Where the hub listens: a socket that only this user can open."""
        return f"unixsock-stream/{self.path / 'hub.sock'}"

    @property
    def config_file(self) -> Path:
        """The run's settings, for the services."""
        return self.path / "config.json"

    def output_file(self, service: str) -> Path:
        """Where a service's stdout and stderr go."""
        return self.path / f"{service}.log"

    def write_info(self, info: SystemInfo) -> None:
        """Say how this system is reached."""
        self._info_file.write_bytes(msgspec.json.encode(info))
        self._info_file.chmod(0o600)

    def info(self) -> SystemInfo:
        """How the running system is reached.

        Raises:
            NotRunningError: none runs in this realm.
        """
        if self._info_file.exists() and self._is_locked():
            return msgspec.json.decode(self._info_file.read_bytes(), type=SystemInfo)
        raise NotRunningError(
            f"no system runs in realm {self.path.name!r}; start one with 'incognita up'"
        )

    @contextmanager
    def claimed(self) -> Generator[None]:
        """Hold the realm while the block runs.

        Raises:
            RealmTakenError: another process holds it.
        """
        with self._lock_file.open("a+") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise RealmTakenError(self._taken()) from None
            os.set_inheritable(lock.fileno(), False)
            lock.truncate(0)
            lock.write(json.dumps({"pid": os.getpid()}))
            lock.flush()
            try:
                yield
            finally:
                self._info_file.unlink(missing_ok=True)

    @property
    def _lock_file(self) -> Path:
        return self.path / "lock"

    @property
    def _info_file(self) -> Path:
        return self.path / "system.json"

    def _is_locked(self) -> bool:
        if not self._lock_file.exists():
            return False
        with self._lock_file.open("a") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return True
        return False

    def _taken(self) -> str:
        try:
            holder: dict[str, Any] = json.loads(self._lock_file.read_text())
        except ValueError:
            holder = {}
        pid = holder.get("pid", "unknown")
        return (
            f"a system already runs in realm {self.path.name!r} (pid {pid}); "
            f"stop it with 'kill {pid}', or choose another realm with --realm"
        )
