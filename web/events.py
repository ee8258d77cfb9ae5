"""The log of events: what happened, in one line each, without repeats."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

from msgspec import Struct

from schemas.belief import MapBelief
from schemas.health import Fault, ServiceState, SystemStatus
from schemas.language import Annotations, Answer, Instruction
from schemas.motion import StopLatch
from schemas.task import Decision, Goal, GoalStatus, InstructionStatus, TaskState
from web.belief_model import observed
from web.phrases import reading

_kept = 300
_healthy = (ServiceState.STARTING, ServiceState.RUNNING)


@dataclass(frozen=True)
class Event:
    """One line of the log."""

    stamp_ns: int
    kind: str
    """"said", "understood", "decided", "saw", "status", "stop" or "fault"."""
    text: str


class EventLog:
    """Turns the stream of messages into events; a message seen again makes none."""

    def __init__(self) -> None:
        self.events: deque[Event] = deque(maxlen=_kept)
        self.count = 0
        self._last: dict[str, str] = {}

    def note(self, message: Struct) -> None:
        """Add what is new in a message."""
        for subject, event in _events(message):
            if self._last.get(subject) != event.text:
                self._last[subject] = event.text
                self.add(event)

    def add(self, event: Event) -> None:
        """Add an event as it is."""
        self.events.append(event)
        self.count += 1


def _events(message: Struct) -> Iterator[tuple[str, Event]]:
    """Events with what they are about; of one subject only a change is an event."""
    match message:
        case Instruction() | Answer() | Annotations():
            yield from _conversation(message)
        case Decision():
            yield "decision", Event(message.stamp_ns, "decided", _without_figures(message.reason))
        case Goal():
            x, y = message.map_from_goal.x, message.map_from_goal.y
            yield "goal", Event(message.stamp_ns, "decided", f"new goal at {x:.1f}, {y:.1f}")
        case GoalStatus() if message.state is TaskState.FAILED:
            text = f"goal not reached: {message.reason}"
            yield f"goal {message.goal_id}", Event(message.stamp_ns, "fault", text)
        case InstructionStatus() if message.state is not TaskState.ACTIVE:
            text = f"instruction {message.state}: {message.reason}"
            yield f"end {message.instruction_id}", Event(message.stamp_ns, "status", text)
        case StopLatch():
            text = "STOPPED" if message.stopped else "stop released"
            yield "stop", Event(message.stamp_ns, "stop", f"{text} ({message.source})")
        case Fault():
            text = f"{message.node}: {message.what} ({message.detail})"
            yield f"fault {message.node}", Event(message.stamp_ns, "fault", text)
        case MapBelief():
            for seen in observed(message):
                yield f"saw {seen.node}", Event(message.stamp_ns, "saw", f"saw a {seen.name}")
        case SystemStatus():
            yield from _service_events(message)
        case _:
            pass


def _conversation(
    message: Instruction | Answer | Annotations,
) -> Iterator[tuple[str, Event]]:
    match message:
        case Instruction():
            yield f"said {message.id}", Event(message.stamp_ns, "said", f"you: {message.text}")
        case Answer():
            said = f"you: {message.text}"
            yield f"answered {message.stamp_ns}", Event(message.stamp_ns, "said", said)
        case Annotations():
            name = message.instruction_id
            told = Event(message.stamp_ns, "understood", _understanding(message))
            yield f"understood {name}", told
            if message.question:
                asked = Event(message.stamp_ns, "understood", f"robot: {message.question}")
                yield f"asked {name}", asked


def _understanding(annotations: Annotations) -> str:
    if annotations.understood and annotations.annotations:
        best = annotations.annotations[0]
        return f"understood: {reading(best)} ({best.probability:.2f})"
    if annotations.understood:
        return "understood"
    return f"not understood: {', '.join(annotations.unknown_words) or annotations.text}"


def _service_events(status: SystemStatus) -> Iterator[tuple[str, Event]]:
    for service in status.services:
        if service.restarts == 0 and service.state in _healthy:
            continue
        text = f"{service.name} {service.state}"
        if service.restarts:
            text += f", restarted {service.restarts} times"
        kind = "status" if service.state is ServiceState.RUNNING else "fault"
        yield f"service {service.name}", Event(status.stamp_ns, kind, text)


def _without_figures(reason: str) -> str:
    """A reason up to its bracket: the figures in it change with every decision."""
    return reason.split(" (", 1)[0]
