"""Labelled pictures side by side, for people to look at."""

from __future__ import annotations

from collections.abc import Sequence

from PIL import Image, ImageDraw

from sim.annotation import TrainingFrame
from sim.assets.library import DETECTED

LABELLED, IGNORED = (255, 255, 0), (150, 150, 255)


def contact_sheet(frames: Sequence[TrainingFrame], columns: int = 5, rows: int = 5) -> Image.Image:
    """Frames from all of a set with their boxes: labelled yellow, ignored pale blue."""
    count = min(len(frames), columns * rows)
    chosen = [frames[index * len(frames) // count] for index in range(count)]
    height, width = chosen[0].color.shape[:2]
    sheet = Image.new("RGB", (columns * width, rows * height))
    for index, frame in enumerate(chosen):
        at = (index % columns * width, index // columns * height)
        sheet.paste(_annotated(frame), at)
    return sheet


def _annotated(frame: TrainingFrame) -> Image.Image:
    image = Image.fromarray(frame.color)
    draw = ImageDraw.Draw(image)
    rows = zip(frame.boxes.tolist(), frame.classes.tolist(), frame.ignored.tolist(), strict=True)
    for (left, top, right, bottom), label, ignored in rows:
        ink = IGNORED if ignored else LABELLED
        draw.rectangle((left, top, right - 1, bottom - 1), outline=ink)
        if not ignored:
            draw.text((left + 2, top - 11 if top > 12 else top + 1), DETECTED[label], fill=ink)
    return image
