"""The perception process: camera frames in, detections out."""

from collections.abc import Iterable

import numpy as np

from robots.catalogue import get_robot
from schemas import topics
from schemas.faults import FaultLog
from schemas.run import RunConfig
from schemas.sensing import RgbdFrame
from schemas.topics import Handlers, Output
from services.perception.detection.bank import detector_of
from services.perception.errors import PerceptionError
from services.perception.scene import Recogniser
from services.perception.soundness import require_sound
from services.perception.space.forms import read_forms


class PerceptionNode:
    """Finds the objects of each frame; remembers nothing from one frame to the next."""

    def __init__(self, run: RunConfig, rng: np.random.Generator) -> None:
        range_max = get_robot(run.robot).camera.range_max
        self._recogniser = Recogniser(detector_of(run), read_forms(), range_max)
        self._faults, self._dropped = FaultLog("perception"), 0

    def handlers(self) -> Handlers:
        """Camera frames, and nothing else."""
        return {topics.RGBD: self.on_frame}

    def on_frame(self, frame: RgbdFrame) -> Iterable[Output]:
        """`Detections` and `Bodies` for every frame that shows anything: none is evidence too.

        A frame in which nothing can be recognised is dropped and told of: to see nothing in it
        would be evidence against everything.
        """
        try:
            require_sound(frame)
            detections, bodies = self._recogniser.recognised(frame)
        except PerceptionError as error:
            self._dropped += 1
            self._faults.note("frame dropped", f"{error}; {self._dropped} dropped so far")
            return [topics.FAULT.of(one) for one in self._faults.due(frame.stamp_ns)]
        return [topics.DETECTIONS.of(detections), topics.BODIES.of(bodies)]
