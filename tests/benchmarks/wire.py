"""Messages between two processes: round trips and losses.

The wire is the one that services use: each end is a client of a hub in a third process. "Wire"
rows send bytes; "service" rows send messages to a whole service with its loop, mailbox and codec.
A round trip is twice the way of one message, through the hub both times.
"""

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack, closing, contextmanager
from importlib.metadata import version
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

from tests.benchmarks.echo import SERVICE_REALM, WIRE_REALM
from tests.benchmarks.links import (
    PINGS,
    PONGS,
    SIZES,
    BusLink,
    IceoryxLink,
    Link,
    MessageLink,
    SocketLink,
    frame_of,
    number_of,
)
from tests.benchmarks.rows import Peer, Row, Samples, compared
from tests.benchmarks.timing import seconds, turned

SOCKET = "socket pair"
ICEORYX = f"iceoryx2 {version('iceoryx2')}"

_root = Path(__file__).parents[2]
_turns = {"100 B": 40, "64 KB": 40, "1 MB": 20}
"""Round trips that a contender makes before the next one has its turn."""
_rates_hz = {"100 B": 100.0, "64 KB": 25.0, "1 MB": 5.0}
"""Of the paced streams, all at once: more than all topics of a robot together."""
_quantiles = {"p50": 0.5, "p99": 0.99}
_drift = {"p50": 3.0, "p99": 10.0}
"""The 99th percentile is that of the scheduler of a busy machine."""
_patience_s = 5.0


def measure(rounds: int) -> list[Row]:
    """Latencies over so many turns of each contender, losses over so many seconds."""
    with tempfile.TemporaryDirectory(prefix="bench-") as directory:
        endpoint = f"unixsock-stream/{directory}/hub.sock"
        with _other_end("hub", endpoint), _contenders(endpoint) as links:
            spent = {size: _round_trips(links, size, rounds) for size in SIZES}
            lost = _paced_losses(links["wire"], rounds)
    latencies = [row for size, trips in spent.items() for row in _latency_rows(size, trips)]
    return latencies + [_loss_row(size, *lost[size], spent[size][SOCKET]) for size in SIZES]


@contextmanager
def _contenders(endpoint: str) -> Generator[Mapping[str, Link]]:
    name = f"incognita-bench-{os.getpid()}"
    ours, theirs = socket.socketpair()
    with theirs, ExitStack() as stack:

        def connect(kind: str, address: str, make: Callable[[], Link]) -> Link:
            # Closed in reverse: the other end goes first and finds its link still open.
            link = stack.enter_context(closing(make()))
            stack.enter_context(_other_end(kind, address, theirs.fileno()))
            _warm_up(link)
            return link

        yield {
            "wire": connect("bus", endpoint, lambda: BusLink(endpoint, WIRE_REALM, PINGS, PONGS)),
            "service": connect(
                "service", endpoint, lambda: MessageLink(endpoint, SERVICE_REALM, PINGS, PONGS)
            ),
            SOCKET: connect("socket", str(theirs.fileno()), lambda: SocketLink(ours)),
            ICEORYX: connect("iceoryx2", name, lambda: IceoryxLink(name, "ping", "pong")),
        }


@contextmanager
def _other_end(kind: str, address: str, *descriptors: int) -> Generator[None]:
    command = [sys.executable, "-m", "tests.benchmarks.echo", kind, address]
    child = subprocess.Popen(
        command,
        cwd=_root,
        pass_fds=descriptors,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert child.stdin is not None
    assert child.stdout is not None
    try:
        said = child.stdout.readline()
        assert said == b"ready\n", f"{kind} ended before it was ready"
        yield
    finally:
        child.stdin.close()
        child.wait(_patience_s)
        child.stdout.close()


def _warm_up(link: Link) -> None:
    """Until the first answer, messages may meet nobody; then the largest touch all buffers."""
    deadline = time.monotonic() + 4 * _patience_s
    while _lost(link, frame_of(0, SIZES["100 B"]), 0.2):
        assert time.monotonic() < deadline, "nobody answers"
    for number, size in enumerate(SIZES.values(), 1):
        _lost(link, frame_of(number, size), _patience_s)


def _lost(link: Link, frame: bytes, timeout_s: float) -> bool:
    """Send a frame and wait for the answer to it; True if none came."""
    wanted = number_of(frame)
    link.send(frame)
    deadline = time.monotonic() + timeout_s
    while (left := deadline - time.monotonic()) > 0:
        back = link.receive(left)
        if back is not None and number_of(back) == wanted:
            return False
    return True


def _round_trips(links: Mapping[str, Link], size: str, rounds: int) -> dict[str, Samples]:
    """Seconds of each round trip; `_patience_s` or more for those without an answer."""
    spent: dict[str, list[float]] = {name: [] for name in links}
    names = list(links)
    for number in range(rounds):
        for name in turned(names, number):
            for turn in range(_turns[size]):
                frame = frame_of(100 + number * _turns[size] + turn, SIZES[size])
                spent[name].append(seconds(lambda f=frame, n=name: _lost(links[n], f, _patience_s)))
    return {name: np.array(times) for name, times in spent.items()}


def _latency_rows(size: str, spent: Mapping[str, Samples]) -> list[Row]:
    return [
        compared(
            f"{ours} round trip {size}",
            metric,
            "ms",
            1e3 * spent[ours],
            (peer, 1e3 * spent[peer]),
            drift=_drift[metric],
            q=q,
        )
        for ours in ("wire", "service")
        for metric, q in _quantiles.items()
        for peer in (SOCKET, ICEORYX)
    ]


def _paced_losses(wire: Link, duration_s: float) -> dict[str, tuple[int, int]]:
    """Lost and sent of streams that flow at the same time, by size."""
    plan = sorted(
        (number / rate, size)
        for size, rate in _rates_hz.items()
        for number in range(int(duration_s * rate))
    )
    sent = dict(enumerate((size for _, size in plan), 1_000_000))
    missing = set(sent)
    started = time.monotonic()

    def listen_until(due: float) -> None:
        while missing and (left := due - time.monotonic()) > 0:
            back = wire.receive(left)
            if back is not None:
                missing.discard(number_of(back))

    for (due, size), number in zip(plan, sent, strict=True):
        listen_until(started + due)
        wire.send(frame_of(number, SIZES[size]))
    listen_until(time.monotonic() + _patience_s)
    return {
        size: (
            sum(sent[number] == size for number in missing),
            sum(each == size for each in sent.values()),
        )
        for size in SIZES
    }


def _loss_row(size: str, lost: int, sent: int, peer: Samples) -> Row:
    interval = binomtest(lost, sent).proportion_ci()
    return Row(
        row=f"wire {size} at {_rates_hz[size]:g} Hz",
        metric="loss",
        unit="%",
        better="lower",
        ours=100 * lost / sent,
        interval=(100 * interval.low, 100 * interval.high),
        peer=Peer(SOCKET, 100 * float(np.mean(peer >= _patience_s))),
        limit=0.0,
    )
