"""Machines for a test: network namespaces behind one switch, each with an address of its own.

They share this machine's files, but neither its network nor its shared memory.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

root = Path(__file__).parents[1]
# Own shared memory and an own name, then the command in place of the shell.
enter = 'hostname "$1" && shift && mount -t tmpfs tmpfs /dev/shm && exec "$@"'


@dataclass(frozen=True)
class Host:
    """One machine."""

    name: str
    namespace: str
    address: str
    folder: Path
    """Its temporary files; short, because the path of a socket may not be long."""

    def start(self, *command: str, stdin: int | None = None) -> subprocess.Popen[str]:
        """A program on it."""
        inside = ["ip", "netns", "exec", self.namespace, "unshare", "--uts", "sh", "-c", enter]
        return subprocess.Popen(
            [*inside, "sh", self.name, *command],
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": str(root), "TMPDIR": str(self.folder)},
            stdin=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def incognita(self, *arguments: str) -> subprocess.Popen[str]:
        """A verb on it."""
        return self.start(sys.executable, "-P", "-m", "services.cli", *arguments)

    def run(self, *command: str, timeout_s: float = 60.0) -> tuple[int, str]:
        """Exit code and output of a program on it."""
        process = self.start(*command)
        try:
            output, _ = process.communicate(timeout=timeout_s)
        finally:
            process.kill()
        return process.returncode, output

    @contextmanager
    def unplugged(self) -> Generator[None]:
        """Without a network while the block runs."""
        _ip(self.namespace, "link set eth0 down")
        try:
            yield
        finally:
            _ip(self.namespace, "link set eth0 up")

    def open_ports(self) -> set[int]:
        """Ports on which anything listens for others than this machine itself."""
        _, text = self.run("cat", "/proc/net/tcp", "/proc/net/tcp6", "/proc/net/udp")
        rows = [line.split() for line in text.splitlines() if ":" in line.split()[0]]
        listening = [row[1].split(":") for row in rows if row[3] in ("0A", "07")]
        loopback = ("0100007F", "00000000000000000000000001000000")
        return {int(port, 16) for address, port in listening if address not in loopback}


@contextmanager
def hosts(*names: str) -> Generator[list[Host]]:
    """Machines that can reach one another; skips the test where that is not permitted."""
    tag = f"inc{os.getpid()}"
    switch = f"{tag}-switch"
    made: list[str] = []
    with tempfile.TemporaryDirectory(prefix="inc-") as folder:
        try:
            _add(switch, made)
            _ip(switch, "link add switch type bridge")
            _ip(switch, "link set switch up")
            yield [_host(Path(folder), tag, switch, made, name, n) for n, name in enumerate(names)]
        finally:
            for namespace in made:
                subprocess.run(["ip", "netns", "delete", namespace], check=False)


def _host(folder: Path, tag: str, switch: str, made: list[str], name: str, number: int) -> Host:
    host = Host(name, f"{tag}-{name}", f"10.77.0.{number + 1}", folder / name)
    host.folder.mkdir()
    _add(host.namespace, made)
    _ip(switch, f"link add port{number} type veth peer name eth0 netns {host.namespace}")
    _ip(switch, f"link set port{number} master switch up")
    _ip(host.namespace, f"address add {host.address}/24 dev eth0")
    _ip(host.namespace, "link set eth0 up")
    _ip(host.namespace, "link set lo up")
    _ip(host.namespace, "route add 224.0.0.0/4 dev eth0")
    return host


def _add(namespace: str, made: list[str]) -> None:
    if sys.platform != "linux":
        pytest.skip("network namespaces are of Linux")
    try:
        _run(["ip", "netns", "add", namespace])
    except (OSError, subprocess.CalledProcessError) as error:
        said = getattr(error, "stderr", "") or str(error)
        pytest.skip(f"network namespaces are not permitted here: {said.strip()}")
    made.append(namespace)


def _ip(namespace: str, command: str) -> None:
    _run(["ip", "-n", namespace, *command.split()])


def _run(command: Iterable[str]) -> None:
    subprocess.run(list(command), check=True, capture_output=True, text=True)
