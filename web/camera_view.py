"""The camera picture with the boxes that were found in it, and what of it was looked at."""

import cv2
import numpy as np

from robots.colours import Rgb, class_colour
from schemas.arrays import Bytes, Ints
from schemas.perception import Detections, Focus
from web.focus_words import line_over
from web.view_model import Shot

_shown_width = 640
_text_scale = 0.7
_font = cv2.FONT_HERSHEY_SIMPLEX
_dimmed = 0.45
"""Brightness of what was not looked at."""
_passed: Rgb = (235, 235, 235)
_white: Rgb = (255, 255, 255)
_black: Rgb = (0, 0, 0)


def annotated(shot: Shot) -> Bytes:
    """RGB picture, 640 pixels wide, with a labelled box around every detection.

    What was not looked at is dark; a line says why, where that is all of it.
    """
    frame, focus = shot.frame, shot.focus
    height, width = frame.color.shape[:2]
    scale = _shown_width / width
    size = (_shown_width, round(height * scale))
    picture = cv2.resize(frame.color, size, interpolation=cv2.INTER_LINEAR)
    picture = np.ascontiguousarray(picture, np.uint8)
    if focus:
        _show_focus(picture, focus, scale)
    if shot.detections:
        _draw_boxes(picture, shot.detections, focus)
    if focus and (line := line_over(focus)):
        _draw_text(picture, line, (0, size[1] - 1), _black)
    return picture


def _draw_boxes(picture: Bytes, found: Detections, focus: Focus | None) -> None:
    to_shown = _shown_width / found.picture_size[0]
    for box, probabilities in zip(found.boxes_px, found.probabilities, strict=True):
        best = int(np.argmax(probabilities))
        name = found.classes[best]
        corners = [round(value * to_shown) for value in box.tolist()]
        wanted = focus is None or name in focus.wanted
        label = f"{name} {probabilities[best]:.2f}"
        _draw_box(picture, corners, label, class_colour(name), 2 if wanted else 1)


def _show_focus(picture: Bytes, focus: Focus, scale: float) -> None:
    looked_at = np.zeros(picture.shape[:2], np.bool_)
    for x0, y0, x1, y1 in _shown(focus.regions_px, scale):
        looked_at[y0:y1, x0:x1] = True
    picture[~looked_at] = (picture[~looked_at] * _dimmed).astype(np.uint8)
    for x0, y0, x1, y1 in _shown(focus.passed_px, scale):
        cv2.rectangle(picture, (x0, y0), (x1, y1), _passed, 1)
        _draw_text(picture, "seen before", (x0, max(y0, 24)), _black)


def _shown(boxes_px: Ints, scale: float) -> list[list[int]]:
    return np.rint(boxes_px * scale).astype(int).tolist()


def _draw_box(picture: Bytes, corners: list[int], label: str, colour: Rgb, line: int) -> None:
    x0, y0, x1, y1 = corners
    cv2.rectangle(picture, (x0, y0), (x1, y1), colour, line)
    _draw_text(picture, label, (x0, y0), colour)


def _draw_text(picture: Bytes, text: str, corner: tuple[int, int], ground: Rgb) -> None:
    """White on a ground whose lower left corner is given, moved in where there is no room."""
    (width, height), _ = cv2.getTextSize(text, _font, _text_scale, 1)
    x = max(0, min(corner[0], picture.shape[1] - width - 8))
    y = max(corner[1], height + 8)
    cv2.rectangle(picture, (x, y - height - 8), (x + width + 8, y), ground, cv2.FILLED)
    cv2.putText(picture, text, (x + 4, y - 5), _font, _text_scale, _white, 1, cv2.LINE_AA)
