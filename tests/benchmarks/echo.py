"""The processes at the other end: `python -m tests.benchmarks.echo KIND ADDRESS`.

They say "ready" when they listen, and end when their standard input does, so that none outlives
a benchmark that was killed.
"""

import socket
import sys
import threading
from collections.abc import Callable, Iterable

from schemas import topics
from schemas.health import SystemStatus
from schemas.topics import Handlers, Output
from services.process_table import Process
from services.runtime.wire import Bus
from services.runtime.worker import Worker
from tests.benchmarks.links import (
    PINGS,
    PONGS,
    ROBOT,
    Blob,
    BusLink,
    IceoryxLink,
    Link,
    SocketLink,
)

WIRE_REALM, SERVICE_REALM = "wire", "service"
_poll_s = 0.2


class EchoNode:
    """A service that answers each message with the same payload."""

    def handlers(self) -> Handlers:
        return dict.fromkeys(PINGS.values(), self.on_ping)

    def on_ping(self, ping: Blob) -> Iterable[Output]:
        return [PONGS[ping.data.size].of(ping)]


def run_hub(endpoint: str, stop: threading.Event) -> None:
    """A hub as the supervisor runs it, of a system that is ready."""
    ready = SystemStatus(
        stamp_ns=0, realm=SERVICE_REALM, robot=ROBOT, world="", ready=True, services=(), faults=()
    )
    with Bus.hub(endpoint, SERVICE_REALM, ROBOT) as hub:
        hub.serve_last_values()
        hub.serve(topics.STATUS, lambda _request: ready)
        _say_ready()
        stop.wait()


def run_service(endpoint: str, stop: threading.Event) -> None:
    """A whole service: its loop, its mailbox, its codec."""
    with Bus.client(endpoint, SERVICE_REALM, ROBOT) as bus:
        worker = Worker(Process("echo", "", latency_ms=0.0), EchoNode(), bus)
        _say_ready()
        worker.run(stop)


def run_bus(endpoint: str, stop: threading.Event) -> None:
    _echo(BusLink(endpoint, WIRE_REALM, PONGS, PINGS), stop)


def run_socket(descriptor: str, stop: threading.Event) -> None:
    _echo(SocketLink(socket.socket(fileno=int(descriptor))), stop)


def run_iceoryx(name: str, stop: threading.Event) -> None:
    _echo(IceoryxLink(name, "pong", "ping"), stop)


KINDS: dict[str, Callable[[str, threading.Event], None]] = {
    "hub": run_hub,
    "service": run_service,
    "bus": run_bus,
    "socket": run_socket,
    "iceoryx2": run_iceoryx,
}


def _echo(link: Link, stop: threading.Event) -> None:
    _say_ready()
    while not stop.is_set():
        frame = link.receive(_poll_s)
        if frame is not None:
            link.send(frame)
    link.close()


def _say_ready() -> None:
    print("ready", flush=True)


def main() -> None:
    kind, address = sys.argv[1:]
    stop = threading.Event()

    def watch() -> None:
        sys.stdin.read()
        stop.set()

    threading.Thread(target=watch, daemon=True).start()
    KINDS[kind](address, stop)


if __name__ == "__main__":
    main()
