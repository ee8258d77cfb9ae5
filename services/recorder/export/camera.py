"""The camera's pictures with boxes around what was found in them."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from robots.colours import class_colour
from schemas import topics
from schemas.arrays import Bytes
from schemas.perception import Detections
from services.recorder.export.pace import evenly
from services.runtime.log_file import read_messages

FPS = 10
"""Of the film [1/s]."""
_enlarged = 2
_shade = (20, 22, 26)


def film(log: Path) -> Iterator[Bytes]:
    """(H, W, 3) RGB pictures at `FPS` in the time of the run, twice as large as the camera's.

    Raises:
        LogError: not a readable log.
    """
    found = {
        message.stamp_ns: message for _, _, message in read_messages(log, (topics.DETECTIONS,))
    }
    frames = (
        (log_ns, (frame.color, found.get(frame.stamp_ns)))
        for log_ns, _, frame in read_messages(log, (topics.RGBD,))
    )
    for picture, boxes in evenly(frames, round(1e9 / FPS)):
        yield _drawn(picture, boxes)


def _drawn(picture: Bytes, found: Detections | None) -> Bytes:
    height, width, _ = picture.shape
    # Even sides: video codecs halve the colours.
    size = (_enlarged * width // 2 * 2, _enlarged * height // 2 * 2)
    image = Image.fromarray(picture).resize(size, Image.Resampling.BILINEAR)
    if found is not None and len(found.scores):
        _draw_boxes(ImageDraw.Draw(image), found)
    return np.asarray(image)


def _draw_boxes(draw: ImageDraw.ImageDraw, found: Detections) -> None:
    for box, row in zip(found.boxes_px, found.probabilities, strict=True):
        best = int(row.argmax())
        x0, y0, x1, y1 = (_enlarged * box).tolist()
        tint = class_colour(found.classes[best])
        draw.rectangle((x0, y0, x1, y1), outline=tint, width=2)
        text, at = f"{found.classes[best]} {row[best]:.2f}", (x0 + 3, max(y0, 0) + 2)
        draw.rectangle(draw.textbbox(at, text), fill=_shade)
        draw.text(at, text, fill=tint)
