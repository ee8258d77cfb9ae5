"""How long perception takes on one core: frame in, objects in space out.

Time is that of the processor, so that what else runs on the machine does not count; OpenCV and
numpy work on one thread here.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import msgspec
import numpy as np
from numpy.random import Generator

from schemas.arrays import Floats
from schemas.sensing import Intrinsics, RgbdFrame
from services.perception.scene import Recogniser
from services.perception.soundness import require_sound
from services.perception.space.rays import depth_metres
from services.perception.space.view import ground_view
from sim.experiments.perception.networks import Networks
from sim.experiments.perception.resampling import quantile_interval
from sim.experiments.report import Row

PAPER_MS = 4100.0
"""Sixteen detectors, one after the other."""
SIZES: dict[tuple[int, int], float] = {(320, 240): 50.0, (640, 480): 100.0}
"""Width and height [px], and what is asked of the whole cycle [ms]."""
FRAMES = 60
"""Frames that are timed."""


@dataclass(frozen=True)
class Cycles:
    """Times of F frames of one size [ms]."""

    whole: Floats
    """(F,) where the camera's pose was seen before, as that of one that is fixed to the base."""
    moved: Floats
    """(F,) where it is new: an arm carries the camera."""
    wall: Floats
    """(F,) as `whole`, by the clock on the wall."""
    network: Floats
    boxes: Floats
    """(F,) from the network's answer to boxes."""
    view: Floats
    """(F,) how far the ground was seen."""

    @property
    def space(self) -> Floats:
        """(F,) from boxes to objects in space."""
        return self.whole - self.network - self.boxes - self.view


def cycles(networks: Networks, recogniser: Recogniser, frames: Sequence[RgbdFrame]) -> Cycles:
    """Time every step on every frame."""
    recogniser.recognised(frames[0])
    rows = [_timed(networks, recogniser, frame) for frame in frames]
    return Cycles(*np.array(rows).T)


def _timed(networks: Networks, recogniser: Recogniser, frame: RgbdFrame) -> tuple[float, ...]:
    def cycle() -> None:
        require_sound(frame)
        recogniser.recognised(frame)

    color, depth = frame.color, depth_metres(frame.depth_mm)
    moved, _ = _spent(cycle)
    whole, wall = _spent(cycle)
    network, _ = _spent(lambda: [one.outputs(color) for one in networks.parts])
    detect, _ = _spent(lambda: networks.working.detect(color))
    view, _ = _spent(
        lambda: ground_view(depth, frame.intrinsics, frame.base_from_camera, recogniser.range_max)
    )
    return whole, moved, wall, network, detect - network, view


def _spent(call: Callable[[], object]) -> tuple[float, float]:
    """Time of the processor and of the wall that a call takes [ms]."""
    cpu, wall = time.process_time(), time.perf_counter()
    call()
    return 1e3 * (time.process_time() - cpu), 1e3 * (time.perf_counter() - wall)


def sized(frame: RgbdFrame, width: int, height: int) -> RgbdFrame:
    """The frame as a camera with more pixels would take it."""
    camera = frame.intrinsics
    x, y = width / camera.width, height / camera.height
    color = cv2.resize(frame.color, (width, height), interpolation=cv2.INTER_LINEAR)
    depth = cv2.resize(frame.depth_mm, (width, height), interpolation=cv2.INTER_NEAREST)
    middle = ((camera.cx + 0.5) * x - 0.5, (camera.cy + 0.5) * y - 0.5)
    return msgspec.structs.replace(
        frame,
        color=np.asarray(color, np.uint8),
        depth_mm=np.asarray(depth, np.uint16),
        intrinsics=Intrinsics(width, height, camera.fx * x, camera.fy * y, *middle),
    )


def cycle_rows(
    networks: Networks, recogniser: Recogniser, frames: Sequence[RgbdFrame], rng: Generator
) -> list[Row]:
    """The whole cycle at both sizes, and what it consists of."""
    rows: list[Row] = []
    for (width, height), asked in SIZES.items():
        found = cycles(networks, recogniser, [sized(one, width, height) for one in frames])
        rows += _size_rows(f"cycle {width}x{height}, one core", found, asked, rng)
    return rows


def _size_rows(name: str, found: Cycles, asked: float, rng: Generator) -> list[Row]:
    whole = [
        msgspec.structs.replace(
            _row(name, f"whole, p{100 * q:g}", found.whole, q, rng),
            paper=PAPER_MS if q == 0.5 else None,
            arms={
                "by the wall clock": float(np.quantile(found.wall, q)),
                "camera that moves": float(np.quantile(found.moved, q)),
            },
            asked=asked,
        )
        for q in (0.5, 0.95)
    ]
    steps = {
        "network": found.network,
        "answer to boxes": found.boxes,
        "boxes to space": found.space,
        "view": found.view,
    }
    return whole + [_row(name, f"{step}, p50", times, 0.5, rng) for step, times in steps.items()]


def _row(name: str, metric: str, times: Floats, q: float, rng: Generator) -> Row:
    return Row(
        row=name,
        metric=metric,
        unit="ms",
        better="lower",
        ours=float(np.quantile(times, q)),
        interval=quantile_interval(times, q, rng),
    )
