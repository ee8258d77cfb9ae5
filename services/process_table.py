"""Every process of the system. Adding a service is adding a row."""

from dataclasses import dataclass

from schemas.errors import UserError


@dataclass(frozen=True)
class Process:
    """One row: what the supervisor, the CLI, lockstep and the drawn graph need to know."""

    name: str
    node: str
    """`module:Class` of the node."""
    latency_ms: float
    """Time one message takes, modelled in lockstep; measured on two shared cores [ms]."""
    tick_hz: float = 0.0
    """How often the node gets a `Tick`; 0 for nodes that only answer messages."""
    hardware: bool = False
    """The robot itself, or what plays its part."""
    lockstep: bool = True
    """Whether the process takes part where no person watches."""
    purpose: str = ""


PROCESSES: tuple[Process, ...] = (
    Process(
        name="robot",
        node="sim.node:RobotNode",
        latency_ms=0.0,
        tick_hz=20.0,
        hardware=True,
        purpose="drives the base and reads the sensors",
    ),
    Process(
        name="perception",
        node="services.perception.node:PerceptionNode",
        latency_ms=40.0,
        purpose="finds objects in camera pictures",
    ),
    Process(
        name="grounding",
        node="services.grounding.node:GroundingNode",
        latency_ms=15.0,
        purpose="turns sentences into annotations and behaviours",
    ),
    Process(
        name="mapping",
        node="services.mapping.node:MappingNode",
        latency_ms=20.0,
        purpose="keeps the distribution over maps",
    ),
    Process(
        name="policy",
        node="services.policy.node:PolicyNode",
        latency_ms=15.0,
        purpose="chooses where to go, and when to stop",
    ),
    Process(
        name="navigation",
        node="services.navigation.node:NavigationNode",
        latency_ms=5.0,
        purpose="plans a path to the goal and follows it",
    ),
    Process(
        name="recorder",
        node="services.recorder.node:RecorderNode",
        latency_ms=0.0,
        lockstep=False,
        purpose="writes every message to the log",
    ),
    Process(
        name="web",
        node="web.node:WebNode",
        latency_ms=0.0,
        tick_hz=10.0,
        lockstep=False,
        purpose="shows the belief and takes instructions",
    ),
)


class UnknownServiceError(UserError):
    """No process has that name; the message lists those that exist."""


def process_named(name: str) -> Process:
    """Look up a process.

    Raises:
        UnknownServiceError: the name is not in `PROCESSES`.
    """
    for process in PROCESSES:
        if process.name == name:
            return process
    valid = ", ".join(process.name for process in PROCESSES)
    raise UnknownServiceError(f"unknown service {name!r}; services are: {valid}")
