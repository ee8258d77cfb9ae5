"""Who takes part in a system of several machines, and what each may say and hear.

A role is what a certificate names. The hub's access rules are generated from here, from the topic
table and from the process table; what is not listed is refused.
"""

from dataclasses import dataclass
from typing import Any

from schemas import topics
from schemas.errors import UserError
from schemas.run import RunConfig
from schemas.topics import Topic
from services.process_table import Process, Topics, process_named

HUB = "hub"
"""Name in the hub's own certificate; nobody connects with it."""
LOCAL = "local"
"""Who connects from the hub's own machine, as the user who started it: may do everything."""
_never_on_the_wire = (topics.TICK,)
"""Every process has a clock of its own."""


class UnknownRoleError(UserError):
    """No role has that name; the message lists those that exist."""


@dataclass(frozen=True)
class Role:
    """One row: the services that a certificate is for. What they need is what it may do."""

    name: str
    purpose: str
    services: tuple[str, ...]
    needed: bool = False
    """Whether no instruction is followed without its services."""

    @property
    def publishes(self) -> Topics:
        """Topics that it may publish."""
        own = [topic for process in self._processes for topic in process.publishes]
        return _in_table_order([*own, *self._of_supervision])

    @property
    def listens(self) -> Topics:
        """Topics that it may subscribe to; it gets the last values of these and of its own."""
        heard = [
            topic
            for process in self._processes
            for topic in process.listens
            if topic not in _never_on_the_wire
        ]
        return _in_table_order([*heard, *self._of_supervision])

    @property
    def _processes(self) -> list[Process]:
        return [process_named(name) for name in self.services]

    @property
    def _of_supervision(self) -> Topics:
        """Services say that they live, and who supervises them on their machine has to hear it."""
        guests_alone = all(process.guest for process in self._processes)
        return () if guests_alone else (topics.HEARTBEAT, topics.FAULT)


ROLES: tuple[Role, ...] = (
    Role(
        "robot",
        "the sensors, and all that moves it",
        ("robot", "camera", "navigation", "manipulation"),
        needed=True,
    ),
    Role(
        "compute",
        "sees, understands, maps and decides, but cannot move anything by itself",
        ("perception", "scenes", "grounding", "mapping", "policy"),
        needed=True,
    ),
    Role("operator", "a person who instructs and stops, and the page for that", ("web",)),
    Role("viewer", "sees what the operator sees and can say nothing", ("viewer",)),
    Role("recorder", "hears everything and writes it down", ("recorder",)),
)


def role_named(name: str) -> Role:
    """Look up a role.

    Raises:
        UnknownRoleError: the name is not in `ROLES`.
    """
    for role in ROLES:
        if role.name == name:
            return role
    valid = ", ".join(role.name for role in ROLES)
    raise UnknownRoleError(f"unknown role {name!r}; roles are: {valid}")


def services_of(role: str, run: RunConfig) -> list[Process]:
    """Processes that a role runs, without those that this run does not need.

    Raises:
        UnknownRoleError: there is no such role.
    """
    processes = [process_named(name) for name in role_named(role).services]
    return [process for process in processes if process.takes_part(run) or process.guest]


def _in_table_order(chosen: list[Topic[Any]]) -> Topics:
    return tuple(topic for topic in topics.ALL_TOPICS if topic in chosen)
