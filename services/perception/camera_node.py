"""A real camera, or pictures from files, as a process: what stands in for the robot's own camera.

As the robot's node steps its driver with every tick, this one lets its source go by one picture,
and hands on those that are due. There is no depth: the pictures say what is there, not how far.
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robots.catalogue import get_robot
from schemas import topics
from schemas.health import Fault, Tick
from schemas.run import RunConfig
from schemas.sensing import RgbdFrame
from schemas.topics import Handlers, Output
from services.perception.camera.lens import Framing, LensError, read_lens, supposed_lens
from services.perception.camera.source import CameraSource, CameraSourceError, open_source


class CameraNode:
    """Publishes the pictures of `RunConfig.camera` at the rate of the robot's camera.

    Raises:
        CameraSourceError: the run names no source of pictures.
        NoCameraError: the source gives none now.
        LensError: the calibration file cannot be used.
    """

    def __init__(
        self, run: RunConfig, rng: np.random.Generator, source: CameraSource | None = None
    ) -> None:
        del rng
        self._spec = get_robot(run.robot).camera
        path = run.camera_calibration
        self._lens = read_lens(Path(path)) if path else None
        self._source, self._name = source or open_source(run.camera), run.camera
        self._due_ns: int | None = None
        self._ended = False

    def handlers(self) -> Handlers:
        """Time, and nothing else."""
        return {topics.TICK: self.on_tick}

    def on_tick(self, tick: Tick) -> Iterable[Output]:
        """The picture that is due, if one is; once, that there are no more.

        What is no picture is dropped and told of.
        """
        if self._ended:
            return
        if self._due_ns is not None and tick.stamp_ns < self._due_ns:
            self._source.skip()
            return
        self._due_ns = tick.stamp_ns + round(1e9 / self._spec.rate_hz)
        try:
            picture = self._source.picture()
            if picture is not None:
                yield topics.RGBD.of(self._frame(picture, tick.stamp_ns))
        except (CameraSourceError, LensError) as error:
            yield _fault(tick, "picture refused", str(error))
            return
        if picture is None:
            self._ended = True
            yield _fault(tick, "no more pictures", f"{self._name} has ended")

    def close(self) -> None:
        """Let the camera go."""
        self._source.close()

    def _frame(self, picture: NDArray[np.uint8], stamp_ns: int) -> RgbdFrame:
        height, width = picture.shape[:2]
        lens = self._lens or supposed_lens(width, height, self._spec.horizontal_fov)
        framing = Framing(lens, self._spec.base_from_camera, self._spec.width)
        return framing.frame(picture, stamp_ns)


def _fault(tick: Tick, what: str, detail: str) -> Output:
    return topics.FAULT.of(Fault(stamp_ns=tick.stamp_ns, node="camera", what=what, detail=detail))
