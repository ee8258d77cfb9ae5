"""What stands before the filter: only messages that can be evidence come through.

The others are reported in words, and so is what the filter itself contained. On the wire anything
may come twice, late, or from a sensor that is broken; a filter that believed it would not recover.
"""

import math
from collections.abc import Callable, Iterable
from typing import Any

from msgspec import Struct

from robots.spec import BaseLimits
from schemas import topics
from schemas.faults import FaultLog
from schemas.geometry import Pose2
from schemas.language import Annotations
from schemas.perception import Detections, Inspection, SceneObservation
from schemas.sensing import LaserScan, Odometry
from schemas.topics import Handler, Handlers, Output, Topic
from services.mapping.contradictions import doubts_about
from services.mapping.soundness import flaw_of, mended
from services.mapping.timeline import Timeline
from services.mapping.wheels import Reading, Step, Wheels

_late_ns = 500_000_000
_Evidence = Detections | SceneObservation | Inspection
"""What the pose of the robot at its stamp belongs to."""

Jumped = Callable[[Pose2, Pose2], None]
"""Called with dead reckoning before and after it jumped."""


class Gate:
    """Admits messages to handlers, and adds the reports to what these return.

    Args:
        limits: of the base, which tell driving from jumps.
        classes: vocabulary of the map.
        faults: what the gate and the filter behind it contained.
        on_jump: told before the first odometry after a jump is handled.
    """

    def __init__(
        self, limits: BaseLimits, classes: tuple[str, ...], faults: FaultLog, on_jump: Jumped
    ) -> None:
        self._faults, self._classes, self._on_jump = faults, classes, on_jump
        self._wheels = Wheels(limits)
        self._timelines: dict[str, Timeline] = {}

    def guarded(self, handlers: Handlers) -> Handlers:
        """The same handlers behind the gate."""
        return {topic: self._guarded(topic, handler) for topic, handler in handlers.items()}

    def resume(self, stamp_ns: int, odom_from_base: Pose2) -> None:
        """Go on from a pose of an earlier life of the process; pictures before it were used."""
        self._wheels.last = Reading(stamp_ns, odom_from_base)
        self._timeline(topics.DETECTIONS).last_ns = stamp_ns

    def _guarded(self, topic: Topic[Any], handler: Handler) -> Handler:
        def handle(message: Any) -> Iterable[Output]:
            outputs = list(handler(found)) if (found := self._admitted(topic, message)) else []
            return outputs + [topics.FAULT.of(one) for one in self._faults.due(message.stamp_ns)]

        return handle

    def _admitted(self, topic: Topic[Any], message: Struct) -> Struct | None:
        """The message as the filter may take it, or None."""
        if flaw := flaw_of(message):
            self._faults.note(f"unusable {topic.key}", flaw)
            return None
        message, flaw = mended(message)
        if flaw:
            self._faults.note(f"flaw in {topic.key}", flaw)
        if isinstance(message, Annotations):
            for what, doubt in doubts_about(message, self._classes):
                self._faults.note(what, doubt)
            return message
        return message if self._is_in_time(topic, message) else None

    def _is_in_time(self, topic: Topic[Any], message: Struct) -> bool:
        if not isinstance(message, Odometry | LaserScan | _Evidence):
            return True
        if flaw := self._timeline(topic).flaw_of(message.stamp_ns):
            self._faults.note(f"late {topic.key}", f"{flaw}: not taken")
            return False
        reading = Reading(message.stamp_ns, message.odom_from_base)
        if isinstance(message, Odometry):
            return self._follows(reading)
        return self._agrees(topic, reading)

    def _timeline(self, topic: Topic[Any]) -> Timeline:
        return self._timelines.setdefault(topic.key, Timeline())

    def _follows(self, reading: Reading) -> bool:
        came_from = self._wheels.here
        step = self._wheels.follow(reading)
        if step is Step.DRIVEN:
            return True
        told = f"{_way(came_from, reading.odom_from_base)} at once is more than the wheels can do"
        if step is Step.DOUBTFUL:
            self._faults.note("doubtful odometry", f"{told}: not taken before a second says so")
            return False
        self._faults.note("odometry jumped", f"{told}: dead reckoning begins anew where it was")
        began = self._wheels.began or reading
        self._on_jump(came_from, began.odom_from_base)
        return True

    def _agrees(self, topic: Topic[Any], reading: Reading) -> bool:
        if not self._wheels.agree_with(reading):
            told = _way(self._wheels.here, reading.odom_from_base)
            self._faults.note(f"unusable {topic.key}", f"its dead reckoning is {told} off")
            return False
        age_ns = self._wheels.last.stamp_ns - reading.stamp_ns if self._wheels.last else 0
        if age_ns > _late_ns:
            told = f"it is {age_ns / 1e9:.2g} s old: taken as evidence of where the robot was then"
            self._faults.note(f"late {topic.key}", told)
        return True


def _way(one: Pose2, other: Pose2) -> str:
    step = one.inverse() @ other
    return f"{math.hypot(step.x, step.y):.3g} m and {abs(math.degrees(step.yaw)):.0f} degrees"
