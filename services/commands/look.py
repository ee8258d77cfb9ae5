"""Verbs that show what there is."""

import itertools
from collections.abc import Iterator
from typing import Annotated, Any

import tyro

from schemas import topics as topic_table
from schemas.codec import as_builtins
from schemas.health import SystemStatus
from services.commands.output import print_json, print_table
from services.process_table import mermaid

_columns = ("service", "state", "pid", "age s", "handled", "busy", "ms", "lost", "replaced")


def status(json: bool = False, realm: str = "default") -> int:
    """Health of every service of a running system.

    Args:
        json: one JSON document on stdout.
        realm: of the running system.
    """
    from services.runtime.client import Client

    with Client(realm) as client:
        now = client.status()
        address = client.info.address
    if json:
        print_json({**as_builtins(now), "address": address})
        return 0
    print(f"{now.robot} in {now.world}, realm {now.realm}: {'ready' if now.ready else 'starting'}")
    if address:
        print(f"page: {address}")
    print_table((*_columns, "bad", "restarts"), _health_rows(now))
    for row in now.services:
        if row.detail:
            print(f"{row.name}: {row.detail}")
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
    realm: str = "default",
) -> int:
    """Print messages of a running system.

    Args:
        topic: as in 'incognita topics'.
        json: one JSON document a line.
        n: end after so many messages.
        realm: of the running system.
    """
    from services.runtime.client import Client

    watched = topic_table.topic_named(topic)
    with Client(realm) as client:
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
