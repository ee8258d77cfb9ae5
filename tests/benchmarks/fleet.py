"""What mutual TLS between machines adds to a message: `python -m tests.benchmarks.fleet`.

A goal goes from the machine that computes to the robot, which answers with its status, over the
hub; beside it the same two ends on the hub's machine, over its unix socket, as with `incognita up`,
and over loopback. Needs root: the machines are network namespaces.
"""

import json
import queue
import subprocess
import sys
import time
from contextlib import ExitStack, closing
from pathlib import Path

from schemas import topics
from schemas.run import RunConfig
from services.runtime.certificates import make
from services.runtime.identity import Identity
from services.runtime.joining import receive_newcomers
from services.runtime.link import Link
from services.runtime.mailbox import Sample
from services.runtime.provenance import machine_description
from services.runtime.wire import Bus
from tests.benchmarks.rows import quantile, quantile_interval
from tests.hosts import Host, hosts

REALM, ROBOT = "bench", "husky"
PLAIN, SEVERAL = "one machine, TCP", "three machines, mutual TLS"
_payload = bytes(100)
_turns, _rounds, _warm_up = 50, 80, 50
_patience_s = 5.0


def hub(local: str, listen: str = "", folder: str = "") -> None:
    identity = Identity.read(Path(folder)) if folder else None
    with Bus.hub(local, REALM, ROBOT, [listen] if listen else [], identity) as bus:
        receive_newcomers(bus, RunConfig(realm=REALM, robot=ROBOT))
        _say("ready")
        sys.stdin.read()


def echo(endpoint: str, folder: str = "") -> None:
    """The robot's end: a goal comes, its status goes."""
    link = Link.to(endpoint, Path(folder) if folder else None)
    with Bus.client(link.endpoint, REALM, ROBOT, identity=link.identity) as bus:
        goals: queue.SimpleQueue[Sample] = queue.SimpleQueue()
        bus.subscribe(topics.GOAL, goals.put)
        _say("ready")
        while (goal := goals.get()).payload:
            bus.publish_bytes(topics.GOAL_STATUS, goal.payload)


def ping(endpoint: str, folder: str = "") -> None:
    """The other end: prints round trips in ms, as many as each line of input asks for."""
    link = Link.to(endpoint, Path(folder) if folder else None)
    with Bus.client(link.endpoint, REALM, ROBOT, identity=link.identity) as bus:
        answers: queue.SimpleQueue[Sample] = queue.SimpleQueue()
        bus.subscribe(topics.GOAL_STATUS, answers.put)
        time.sleep(0.5)
        _say("ready")
        for line in sys.stdin:
            _say(json.dumps([_round_trip_ms(bus, answers) for _ in range(int(line))]))
        bus.publish_bytes(topics.GOAL, b"")
        time.sleep(0.2)


def _round_trip_ms(bus: Bus, answers: "queue.SimpleQueue[Sample]") -> float:
    started = time.perf_counter()
    bus.publish_bytes(topics.GOAL, _payload)
    answers.get(timeout=_patience_s)
    return 1000 * (time.perf_counter() - started)


def _say(text: str) -> None:
    print(text, flush=True)


class Program:
    """One end as a process on a machine."""

    def __init__(self, host: Host, *arguments: str) -> None:
        command = [sys.executable, "-P", "-m", "tests.benchmarks.fleet", *arguments]
        self._process = host.start(*command, stdin=subprocess.PIPE)
        assert self.line() == "ready"

    def line(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline().strip()

    def ask(self, count: int) -> list[float]:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{count}\n")
        self._process.stdin.flush()
        return json.loads(self.line())

    def close(self) -> None:
        self._process.communicate(timeout=_patience_s)


def measure() -> dict[str, list[float]]:
    """Round trips in ms on one machine and between three, in turns."""
    with hosts("robot", "compute", "hub") as (robot, compute, middle), ExitStack() as stack:

        def program(host: Host, *arguments: str) -> Program:
            return stack.enter_context(closing(Program(host, *arguments)))

        certs = middle.folder / "certs"
        make(certs, [middle.address], days=1)
        unix, *others = [f"unixsock-stream/{middle.folder}/{name}.sock" for name in "abc"]
        loopback, apart = "tcp/127.0.0.1:7448", f"tls/{middle.address}:7447"
        # A hub for each, or all would answer the same goals. The first is that of `incognita up`.
        program(middle, "hub", unix)
        program(middle, "hub", others[0], loopback)
        program(middle, "hub", others[1], apart, str(certs / "hub"))
        program(middle, "echo", unix)
        program(middle, "echo", loopback)
        program(robot, "echo", apart, str(certs / "robot"))
        pinging = {
            "one machine, unix socket": program(middle, "ping", unix),
            PLAIN: program(middle, "ping", loopback),
            SEVERAL: program(compute, "ping", apart, str(certs / "compute")),
        }
        trips: dict[str, list[float]] = {name: [] for name in pinging}
        for ping in pinging.values():
            ping.ask(_warm_up)
        for _ in range(_rounds):
            for name, ping in pinging.items():
                trips[name] += ping.ask(_turns)
        return trips


def main() -> None:
    trips = measure()
    for name, spent in trips.items():
        # A message goes one way, a round trip both.
        one_way = [trip / 2 for trip in spent]
        low, high = quantile_interval(one_way)
        print(
            f"{name}: p50 {quantile(one_way):.3f} ms ({low:.3f} .. {high:.3f}), "
            f"p99 {quantile(one_way, 0.99):.3f} ms one way, {len(one_way)} messages"
        )
    added = (quantile(trips[SEVERAL]) - quantile(trips[PLAIN])) / 2
    print(f"added to TCP by mutual TLS and rules: p50 {added:.3f} ms ({machine_description()})")


if __name__ == "__main__":
    ends = {"hub": hub, "echo": echo, "ping": ping}
    if len(sys.argv) > 1:
        ends[sys.argv[1]](*sys.argv[2:])
    else:
        main()
