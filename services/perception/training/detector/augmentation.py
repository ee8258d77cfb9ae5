"""Labelled pictures changed at random, so that few are as good as many."""

from collections.abc import Iterator, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from services.perception.detection.picture import padding_value
from services.perception.training.detector.frames import Frame

least_side = 3.0
"""Objects that are cut to a shorter side than this are ignored [px]."""
_least_kept = 0.3
"""So are those of which less than this part is left."""
_least_trace = 1.0
"""Of what has a shorter side than this nothing is left [px]."""
_scales = (0.65, 1.6)
_furthest_shift = 0.15
"""In sides of the picture."""


def augmented(frame: Frame, rng: np.random.Generator) -> Frame:
    """The frame mirrored, moved, scaled and recoloured at random."""
    height, width = frame.color.shape[:2]
    scale = float(np.exp(rng.uniform(*np.log(_scales))))
    shift = rng.uniform(-_furthest_shift, _furthest_shift, 2) * (width, height)
    moved = _moved(frame, scale, -1.0 if rng.random() < 0.5 else 1.0, shift)
    return Frame(_recoloured(moved.color, rng), moved.boxes, moved.classes, moved.ignored)


def mirrored(frame: Frame, rng: np.random.Generator) -> Frame:
    """The frame as it is, or its mirror image: what the network learns from last.

    Moved and recoloured pictures are not quite what the camera shows; boxes fit tighter when the
    last steps are taken on pictures that are.
    """
    return frame if rng.random() < 0.5 else _moved(frame, 1.0, -1.0, np.zeros(2))


def shuffled(frames: Sequence[Frame], size: int, rng: np.random.Generator) -> Iterator[list[Frame]]:
    """Batches in random order without end, each frame once before any comes again."""
    waiting: list[int] = []
    while True:
        while len(waiting) < size:
            waiting += rng.permutation(len(frames)).tolist()
        chosen, waiting = waiting[:size], waiting[size:]
        yield [frames[index] for index in chosen]


_fill = (padding_value, padding_value, padding_value)


def _moved(frame: Frame, scale: float, mirror: float, shift: NDArray[np.float64]) -> Frame:
    """Scaled about the middle and shifted [px]; what is cut off is ignored or gone."""
    height, width = frame.color.shape[:2]
    middle, linear = np.array([width / 2, height / 2]), np.diag([mirror * scale, scale])
    new_from_old = np.column_stack([linear, middle + shift - linear @ middle])
    # Boxes are measured between pixel corners, the warp between pixel centres.
    between_centres = new_from_old.copy()
    between_centres[:, 2] += linear @ [0.5, 0.5] - 0.5
    color = cv2.warpAffine(frame.color, between_centres, (width, height), borderValue=_fill)
    boxes, whole, there = _cut(frame.boxes, new_from_old, width, height)
    ignored = (frame.ignored | ~whole)[there]
    return Frame(np.asarray(color, np.uint8), boxes[there], frame.classes[there], ignored)


def _cut(
    boxes: NDArray[np.float32], new_from_old: NDArray[np.float64], width: int, height: int
) -> tuple[NDArray[np.float32], NDArray[np.bool_], NDArray[np.bool_]]:
    """Boxes cut at the picture's edge; which are still worth a label; which are there at all."""
    ends = boxes.reshape(-1, 2, 2) @ new_from_old[:, :2].T + new_from_old[:, 2]
    uncut = np.concatenate([ends.min(1), ends.max(1)], 1)
    cut = np.clip(uncut, 0, [width, height, width, height])
    sides, all_sides = cut[:, 2:] - cut[:, :2], uncut[:, 2:] - uncut[:, :2]
    whole = (sides.min(1) >= least_side) & (sides.prod(1) >= _least_kept * all_sides.prod(1))
    return cut.astype(np.float32), whole, sides.min(1) >= _least_trace


def _recoloured(color: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Brightness, contrast, tint, and now and then the noise and blur of a real camera."""
    gain = rng.uniform(0.7, 1.35) * rng.uniform(0.92, 1.08, 3)
    table = np.arange(256)[:, None] * gain + rng.uniform(-18, 18)
    table = np.clip(table, 0, 255).astype(np.uint8).reshape(256, 1, 3)
    color = np.asarray(cv2.LUT(color, table), np.uint8)
    if rng.random() < 0.2:
        color = _saturated(color, rng.uniform(0.4, 1.4))
    if rng.random() < 0.15:
        color = np.asarray(cv2.blur(color, (3, 3)), np.uint8)
    if rng.random() < 0.3:
        noise = rng.normal(0, rng.uniform(2, 8), color.shape)
        color = np.clip(color + noise, 0, 255).astype(np.uint8)
    return color


def _saturated(color: NDArray[np.uint8], saturation: float) -> NDArray[np.uint8]:
    """Nearer to grey below 1, more colourful above."""
    grey = np.asarray(cv2.cvtColor(color, cv2.COLOR_RGB2GRAY))[..., None]
    grey = np.broadcast_to(grey, color.shape).copy()
    return np.asarray(cv2.addWeighted(color, saturation, grey, 1 - saturation, 0.0), np.uint8)
