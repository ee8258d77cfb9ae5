"""The table of what viewers see, and what fills it while a run is recorded."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from google.protobuf.message import Message

from robots.spec import RobotSpec
from schemas import topics
from schemas.codec import MalformedMessageError, decode
from schemas.topics import Topic
from services.recorder.viewer import ground, picture, plan, scene, words
from services.recorder.viewer.frames import Frames
from services.recorder.viewer.numbers import numbers
from services.runtime.mailbox import Sample

Show = Callable[[Any], Message | Iterable[Message]]

EVERY = 0.0
"""Rate of channels that follow events."""
_early = 0.8
"""Share of its period after which a message is due, because stamps jitter."""


@dataclass(frozen=True)
class Channel:
    """One row: what a viewer sees, out of which messages, and how often at most."""

    topic: str
    source: Topic[Any]
    show: Show
    max_hz: float = EVERY
    """However much traffic there is, drawing it costs no more than this."""


@dataclass(frozen=True)
class Shown:
    """A message for viewers."""

    topic: str
    message: Message


def channels(spec: RobotSpec) -> tuple[Channel, ...]:
    """The table for one run of a robot."""
    frames = Frames(spec)
    return (
        Channel("/tf", topics.ODOMETRY, frames.on_odometry, 20),
        Channel("/tf", topics.BELIEF, frames.on_belief),
        Channel("/tf", topics.RGBD, frames.on_picture, 5),
        Channel("/tf", topics.SCAN, frames.on_scan, 5),
        Channel("/camera/image", topics.RGBD, picture.image, 10),
        Channel("/camera/calibration", topics.RGBD, picture.calibration, 10),
        Channel("/camera/boxes", topics.DETECTIONS, picture.boxes, 10),
        Channel("/laser/scan", topics.SCAN, ground.scan, 10),
        Channel("/map/floor", topics.GRID, ground.grid, 2),
        Channel("/map/objects", topics.BELIEF, scene.belief_scene, 2),
        Channel("/robot", topics.ODOMETRY, lambda o: scene.robot_box(spec, o), 1),
        Channel("/plan/candidates", topics.DECISION, plan.candidates, 2),
        Channel("/plan/goal", topics.GOAL, plan.goal),
        Channel("/plan/path", topics.GOAL_STATUS, plan.path, 2),
        Channel("/plan/candidates", topics.INSTRUCTION_STATUS, plan.over),
        Channel("/plan/goal", topics.INSTRUCTION_STATUS, plan.over),
        Channel("/plan/path", topics.INSTRUCTION_STATUS, plan.over),
        Channel("/log", topics.INSTRUCTION, words.instruction),
        Channel("/log", topics.ANSWER, words.answer),
        Channel("/log", topics.ANNOTATIONS, words.understood),
        Channel("/log", topics.DECISION, words.decided),
        Channel("/log", topics.INSTRUCTION_STATUS, words.progress),
        Channel("/log", topics.FAULT, words.fault),
        Channel("/log", topics.STOP, words.stop),
        Channel("/log", topics.CANCEL, words.cancel),
        Channel("/numbers/motion", topics.ODOMETRY, numbers("Motion"), 20),
        Channel("/numbers/command", topics.BASE_COMMAND, numbers("Command"), 20),
        Channel("/numbers/belief", topics.BELIEF, numbers("Belief"), 5),
        Channel("/numbers/decision", topics.DECISION, numbers("Decision")),
        Channel("/numbers/health", topics.HEARTBEAT, numbers("Health")),
    )


class Viewer:
    """Turns what was sent into what is seen."""

    def __init__(self, spec: RobotSpec) -> None:
        self._rows: dict[str, list[Channel]] = {}
        for row in channels(spec):
            self._rows.setdefault(row.source.key, []).append(row)
        self._shown_ns: dict[Channel, int] = {}

    def show(self, sample: Sample) -> Iterator[Shown]:
        """What is seen of a message; nothing of one that cannot be read."""
        due = [row for row in self._rows.get(sample.topic.key, ()) if self._is_due(row, sample)]
        if not due:
            return
        try:
            message = decode(sample.payload, sample.topic.type)
        except MalformedMessageError:
            return
        for row in due:
            self._shown_ns[row] = sample.sent_ns
            shown = row.show(message)
            for one in [shown] if isinstance(shown, Message) else shown:
                yield Shown(row.topic, one)

    def _is_due(self, row: Channel, sample: Sample) -> bool:
        before = self._shown_ns.get(row)
        if before is None or row.max_hz == EVERY:
            return True
        return sample.sent_ns - before >= _early * 1e9 / row.max_hz
