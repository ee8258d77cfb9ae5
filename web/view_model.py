"""What is known right now: the newest message of each topic, how old it is, how often it comes."""

import math
from collections import deque
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, cast

from msgspec import Struct

from schemas import topics
from schemas.geometry import Pose2
from schemas.health import SystemStatus
from schemas.language import Annotations
from schemas.perception import Detections, Focus
from schemas.sensing import RgbdFrame
from schemas.task import InstructionStatus, TaskState
from schemas.topics import Topic
from web.events import EventLog

T = TypeVar("T", bound=Struct)

STALE_AFTER_S = 1.0
"""Silence of the robot after which nothing on the page counts as live."""
_moving_faster_than = 0.02
_pairing_limit_ns = 800_000_000


class _Stamped(Protocol):
    stamp_ns: int


@dataclass(frozen=True)
class Shot:
    """A camera picture to show."""

    frame: RgbdFrame
    detections: Detections | None
    """What was found in it, or in an earlier one that showed the same."""
    focus: Focus | None
    """What was attended to in it."""


class ViewModel:
    """Everything the page shows comes from here; it knows no browser and no viser."""

    def __init__(self, start_ns: int) -> None:
        self.start_ns = start_ns
        self.now_ns = start_ns
        self.events = EventLog()
        self._newest: dict[str, Struct] = {}
        self._stamps: dict[str, int] = {}
        self._periods: dict[str, float] = {}
        self._service_rates: dict[str, float] = {}
        self._ended: set[str] = set()
        self._frames: deque[RgbdFrame] = deque(maxlen=6)
        self._found: deque[Detections] = deque(maxlen=3)

    def put(self, topic: Topic[T], message: T) -> None:
        """Take in a message."""
        self.events.note(message)
        if isinstance(message, SystemStatus):
            self._measure_services(message)
        self._newest[topic.key] = message
        self._measure(topic, cast(_Stamped, message).stamp_ns)
        if isinstance(message, InstructionStatus) and message.state is not TaskState.ACTIVE:
            self._ended.add(message.instruction_id)
        if isinstance(message, RgbdFrame):
            self._frames.append(message)
        if isinstance(message, Detections):
            self._found.append(message)

    def tick(self, stamp_ns: int) -> None:
        """Let time pass."""
        if self.start_ns == 0:
            self.start_ns = stamp_ns
        self.now_ns = stamp_ns

    def get(self, topic: Topic[T]) -> T | None:
        """Newest message of a topic, None before the first."""
        return cast("T | None", self._newest.get(topic.key))

    def age_s(self, topic: Topic[Any]) -> float:
        """Time since the newest message of a topic was taken [s]; infinite before the first."""
        stamp = self._stamps.get(topic.key)
        return math.inf if stamp is None else max(0.0, (self.now_ns - stamp) / 1e9)

    def rate_hz(self, topic: Topic[Any]) -> float:
        """How often a topic came lately [1/s]; 0 before its second message."""
        period = self._periods.get(topic.key, 0.0)
        return 1.0 / period if period > 0 else 0.0

    def service_rate_hz(self, name: str) -> float:
        """Messages that a service handled per second, between the last two reports [1/s]."""
        return self._service_rates.get(name, 0.0)

    @property
    def live(self) -> bool:
        """Whether the robot itself was heard of within `STALE_AFTER_S`."""
        return self.age_s(topics.ODOMETRY) < STALE_AFTER_S

    @property
    def stopped(self) -> bool:
        """Whether all motion is latched off."""
        latch = self.get(topics.STOP)
        return latch is not None and latch.stopped

    @property
    def moving(self) -> bool:
        """Whether the robot drives or turns."""
        odometry = self.get(topics.ODOMETRY)
        if odometry is None:
            return False
        return max(abs(odometry.linear), abs(odometry.angular)) > _moving_faster_than

    @property
    def active(self) -> bool:
        """Whether an instruction is being followed."""
        status = self.get(topics.INSTRUCTION_STATUS)
        return status is not None and status.state is TaskState.ACTIVE

    @property
    def asked(self) -> Annotations | None:
        """The instruction with the open question, if there is one."""
        newest = self.get(topics.ANNOTATIONS)
        if newest is None or not newest.question or newest.instruction_id in self._ended:
            return None
        return newest

    @property
    def map_from_odom(self) -> Pose2:
        """Newest estimate of how dead reckoning has drifted."""
        belief = self.get(topics.BELIEF)
        return belief.map_from_odom if belief else Pose2(0.0, 0.0, 0.0)

    @property
    def map_from_base(self) -> Pose2:
        """Where the robot is, at the rate of its odometry."""
        odometry = self.get(topics.ODOMETRY)
        odom_from_base = odometry.odom_from_base if odometry else Pose2(0.0, 0.0, 0.0)
        return self.map_from_odom @ odom_from_base

    def picture(self) -> Shot | None:
        """The camera picture to show, with what was detected in that very picture.

        Boxes belong to the frame they were found in: on a newer one they would lag behind, unless
        perception says that they hold for it. Where it has fallen too far behind, the newest frame
        is shown without boxes.
        """
        if not self._frames:
            return None
        focus, detections = self.get(topics.FOCUS), self.get(topics.DETECTIONS)
        shot = self._shot(focus.stamp_ns, focus.seen_ns, focus) if focus else None
        if shot is None and detections:
            shot = self._shot(detections.stamp_ns, detections.stamp_ns, None)
        return shot or Shot(self._frames[-1], None, None)

    def _shot(self, stamp_ns: int, seen_ns: int, focus: Focus | None) -> Shot | None:
        """A recent frame with what was found at another's time, if both are still there."""
        frame = next((one for one in self._frames if one.stamp_ns == stamp_ns), None)
        found = next((one for one in self._found if one.stamp_ns == seen_ns), None)
        recent = self._frames[-1].stamp_ns - stamp_ns < _pairing_limit_ns
        return Shot(frame, found, focus) if frame and found and recent else None

    def _measure_services(self, status: SystemStatus) -> None:
        before = self.get(topics.SYSTEM_STATUS)
        if before is None or status.stamp_ns <= before.stamp_ns:
            return
        elapsed_s = (status.stamp_ns - before.stamp_ns) / 1e9
        handled = {service.name: service.handled for service in before.services}
        for service in status.services:
            more = max(0, service.handled - handled.get(service.name, 0))
            self._service_rates[service.name] = more / elapsed_s

    def _measure(self, topic: Topic[Any], stamp_ns: int) -> None:
        before = self._stamps.get(topic.key)
        if before is not None and stamp_ns <= before:
            return
        self._stamps[topic.key] = stamp_ns
        if before is not None:
            period = (stamp_ns - before) / 1e9
            smooth = self._periods.get(topic.key, period)
            self._periods[topic.key] = 0.8 * smooth + 0.2 * period
