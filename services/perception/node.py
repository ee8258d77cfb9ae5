"""The perception process: camera frames and what people ask for in, detections out."""

from collections.abc import Iterable

import numpy as np
from msgspec.structs import replace

from robots.catalogue import get_robot
from schemas import topics
from schemas.faults import FaultLog
from schemas.language import Annotations
from schemas.perception import Focus
from schemas.run import RunConfig
from schemas.sensing import RgbdFrame, WristFrame
from schemas.task import HandlingStatus, InstructionStatus, TaskState
from schemas.topics import Handlers, Output
from services.perception.attention.attention import Attention, Plan
from services.perception.attention.interest import Interest
from services.perception.attention.savings import Savings
from services.perception.detection.bank import detector_of
from services.perception.detection.gaze import Gaze
from services.perception.errors import PerceptionError
from services.perception.scene import Look, Recogniser, Seen
from services.perception.soundness import require_sound
from services.perception.space.forms import read_forms

_no_view = np.zeros(0)


class PerceptionNode:
    """Finds the objects of each frame.

    With `RunConfig.adaptive` it attends to what the instruction needs, and says so; without, it
    looks at all of every frame and remembers nothing from one to the next.
    """

    def __init__(self, run: RunConfig, rng: np.random.Generator) -> None:
        del rng
        robot, self._adaptive = get_robot(run.robot), run.adaptive
        range_max = robot.camera.range_max
        self._detector = detector_of(run)
        self._recogniser = Recogniser(self._detector, read_forms(), range_max)
        self._interest = Interest(self._detector.classes, robot.symbols.locations)
        self._attention = Attention(self._detector.groups, range_max)
        self._savings = Savings(self._detector.pixels)
        self._faults, self._dropped = FaultLog("perception"), 0
        self._handling = False

    def handlers(self) -> Handlers:
        """Camera frames, and what decides what matters in them."""
        return {
            topics.RGBD: self.on_frame,
            topics.ANNOTATIONS: self.on_annotations,
            topics.INSTRUCTION_STATUS: self.on_status,
            topics.WRIST_RGBD: self.on_wrist,
            topics.HANDLING_STATUS: self.on_handling,
        }

    def on_annotations(self, annotations: Annotations) -> Iterable[Output]:
        """Attend to what an instruction needs, from the next frame on."""
        self._interest.hear(annotations)
        self._attend()
        return ()

    def on_status(self, status: InstructionStatus) -> Iterable[Output]:
        """Attend to nothing in particular once the instruction has ended."""
        self._interest.follow(status)
        self._attend()
        return ()

    def on_frame(self, frame: RgbdFrame) -> Iterable[Output]:
        """`Detections` and `Bodies` for every frame that is looked at: none is evidence too.

        A frame in which nothing can be recognised is dropped and told of: to see nothing in it
        would be evidence against everything.
        """
        try:
            require_sound(frame)
            if self._adaptive:
                return list(self._attentively(frame))
            return _told(self._recogniser.recognised(frame))
        except PerceptionError as error:
            self._dropped += 1
            self._attention.forget()
            self._faults.note("frame dropped", f"{error}; {self._dropped} dropped so far")
            return [topics.FAULT.of(one) for one in self._faults.due(frame.stamp_ns)]

    def on_handling(self, status: HandlingStatus) -> Iterable[Output]:
        """Look through the wrist's camera for as long as the arm is at work."""
        self._handling = status.state is TaskState.ACTIVE
        return ()

    def on_wrist(self, frame: WristFrame) -> Iterable[Output]:
        """The same for a picture of the wrist's camera, which tells nothing of the ground."""
        if not self._handling:
            return []
        try:
            require_sound(frame)
            seen = self._recogniser.recognised(frame)
        except PerceptionError as error:
            self._dropped += 1
            self._faults.note(
                "wrist frame dropped", f"{error}; {self._dropped} frames dropped so far"
            )
            return [topics.FAULT.of(one) for one in self._faults.due(frame.stamp_ns)]
        detections = replace(seen.detections, view_bearings=_no_view, view_ranges=_no_view)
        return [topics.WRIST_DETECTIONS.of(detections), topics.WRIST_BODIES.of(seen.bodies)]

    def _attend(self) -> None:
        if self._attention.want(self._interest.wanted):
            self._savings.begin()

    def _attentively(self, frame: RgbdFrame) -> Iterable[Output]:
        plan = self._attention.plan(frame)
        gaze = Gaze(plan.regions, plan.networks)
        if plan.looks:
            seen = self._recogniser.recognised(frame, _look_of(plan, gaze))
            self._attention.note(seen.boxes.corners_px, seen.matters, frame.odom_from_base)
            yield from _told(seen)
        yield topics.FOCUS.of(self._focus(frame, plan, gaze))

    def _focus(self, frame: RgbdFrame, plan: Plan, gaze: Gaze) -> Focus:
        work = self._savings.count(frame, gaze if plan.looks else None)
        size = frame.intrinsics.width, frame.intrinsics.height
        return Focus(
            stamp_ns=frame.stamp_ns,
            wanted=tuple(sorted(plan.wanted)),
            seen_ns=self._attention.seen_ns,
            reason=plan.reason,
            unsought=plan.unsought,
            regions_px=np.rint(self._detector.looked_at(*size, gaze)).astype(np.int32),
            passed_px=plan.passed.boxes_px if plan.passed else np.zeros((0, 4), np.int32),
            work=work,
            saved=self._savings.share,
        )


def _look_of(plan: Plan, gaze: Gaze) -> Look:
    passed = (plan.passed.left, plan.passed.right) if plan.passed else None
    # The few looks while nothing is asked for may take their time.
    return Look(gaze, plan.wanted or None, plan.unsought, passed)


def _told(seen: Seen) -> list[Output]:
    return [topics.DETECTIONS.of(seen.detections), topics.BODIES.of(seen.bodies)]
