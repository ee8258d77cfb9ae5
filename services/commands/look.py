"""Verbs that show what there is."""

import itertools
from collections.abc import Iterator
from typing import Annotated, Any

import tyro

from schemas import topics as topic_table
from schemas.codec import as_builtins
from schemas.health import SystemStatus
from services.commands.output import print_json, print_table
from services.commands.where import HERE, System
from services.process_table import mermaid
from services.roles import LOCAL

_worth_saying_ms = 20
_columns = ("service", "state", "host", "pid", "age s", "handled", "busy", "ms", "lost", "replaced")


def status(json: bool = False, system: System = HERE) -> int:
    """Health of every service of a running system.

    Args:
        json: one JSON document on stdout.
        system: which one.
    """
    with system.client() as client:
        now = client.status()
        access = client.access()
        address = client.info.address
    if json:
        print_json({**as_builtins(now), "address": address, "access": as_builtins(access)})
        return 0
    print(f"{now.robot} in {now.world}, realm {now.realm}: {'ready' if now.ready else 'starting'}")
    if address:
        print(f"page: {address}")
    if access.role != LOCAL:
        print(f"you are {access.role}: you may publish {', '.join(access.publishes) or 'nothing'}")
    print_table((*_columns, "bad", "restarts"), _health_rows(now))
    for row in now.services:
        if row.detail:
            print(f"{row.name}: {row.detail}")
    for row in now.services:
        if abs(row.clock_offset_ms) >= _worth_saying_ms:
            print(f"{row.name}: the clock of {row.host} is {row.clock_offset_ms:+.0f} ms off")
    for fault in now.faults:
        print(f"fault: {fault.node}: {fault.what}: {fault.detail}")
    return 0


def topics(json: bool = False) -> int:
    """The table of topics.

    Args:
        json: one JSON document on stdout.
    """
    rows = [
        {
            "topic": topic.key,
            "type": topic.type.__name__,
            "qos": str(topic.qos),
            "rate_hz": topic.rate_hz,
            "keep_last": topic.keep_last,
            "rank": topic.rank,
        }
        for topic in topic_table.ALL_TOPICS
    ]
    if json:
        print_json(rows)
    else:
        print_table(tuple(rows[0]), [tuple(row.values()) for row in rows])
    return 0


def graph() -> int:
    """The processes and what flows between them, as a Mermaid diagram."""
    print(mermaid())
    return 0


def watch(
    topic: Annotated[str, tyro.conf.Positional],
    json: bool = False,
    n: Annotated[int | None, tyro.conf.arg(aliases=["-n"])] = None,
    system: System = HERE,
) -> int:
    """Print messages of a running system.

    Args:
        topic: as in 'incognita topics'.
        json: one JSON document a line.
        n: end after so many messages.
        system: which one.
    """
    watched = topic_table.topic_named(topic)
    with system.client() as client:
        messages = _endless(client.watch(watched))
        for _, message in itertools.islice(messages, n):
            if json:
                print_json(as_builtins(message))
            else:
                print(message, flush=True)
    return 0


def robots(json: bool = False) -> int:
    """The robots there are.

    Args:
        json: one JSON document on stdout.
    """
    from robots.catalogue import ROBOTS

    if json:
        print_json([{"name": spec.name, "title": spec.title} for spec in ROBOTS.values()])
    else:
        print_table(("robot", "what it is"), [(s.name, s.title) for s in ROBOTS.values()])
    return 0


def worlds(json: bool = False) -> int:
    """The worlds there are.

    Args:
        json: one JSON document on stdout.
    """
    from sim.world import world_summaries

    summaries = world_summaries()
    if json:
        print_json([{"name": name, "summary": text} for name, text in summaries.items()])
    else:
        print_table(("world", "what is in it"), summaries.items())
    return 0


def _endless(subscription: Any) -> Iterator[Any]:
    while True:
        yield from subscription.messages(timeout_s=1.0)


def _health_rows(now: SystemStatus) -> Iterator[tuple[object, ...]]:
    for row in now.services:
        yield (
            row.name,
            row.state,
            row.host,
            row.pid,
            f"{row.age_s:.1f}",
            row.handled,
            f"{100 * row.busy:.0f} %",
            f"{row.handler_ms:.1f}",
            row.lost,
            row.replaced,
            row.malformed,
            row.restarts,
        )
