"""The perception process: camera frames in, detections out."""

from collections.abc import Iterable

import numpy as np

from robots.catalogue import get_robot
from schemas import topics
from schemas.perception import Detections
from schemas.run import RunConfig
from schemas.sensing import RgbdFrame
from schemas.topics import Handlers, Output
from services.perception.detector import Detector
from services.perception.scene import detections_in


class PerceptionNode:
    """Finds the objects of each frame; remembers nothing from one frame to the next."""

    def __init__(self, run: RunConfig, rng: np.random.Generator) -> None:
        self._range_max = get_robot(run.robot).camera.range_max
        self._detector = Detector()

    def handlers(self) -> Handlers:
        """Camera frames, and nothing else."""
        return {topics.RGBD: self.on_frame}

    def on_frame(self, frame: RgbdFrame) -> Iterable[Output]:
        """One `Detections` for every frame: an empty one is evidence too."""
        found: Detections = detections_in(frame, self._detector, self._range_max)
        return [topics.DETECTIONS.of(found)]
