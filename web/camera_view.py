"""The camera picture with the boxes that were found in it."""

import cv2
import numpy as np

from schemas.arrays import Bytes
from schemas.perception import Detections
from schemas.sensing import RgbdFrame
from web.colours import class_colour

_shown_width = 640
_text_scale = 0.55
_font = cv2.FONT_HERSHEY_SIMPLEX


def annotated(frame: RgbdFrame, detections: Detections | None) -> Bytes:
    """RGB picture, 640 pixels wide, with a labelled box around every detection."""
    height, width = frame.color.shape[:2]
    scale = _shown_width / width
    size = (_shown_width, round(height * scale))
    picture = cv2.resize(frame.color, size, interpolation=cv2.INTER_LINEAR)
    picture = np.ascontiguousarray(picture, np.uint8)
    if detections:
        to_shown = _shown_width / detections.picture_size[0]
        for box, probabilities in zip(detections.boxes_px, detections.probabilities, strict=True):
            best = int(np.argmax(probabilities))
            label = f"{detections.classes[best]} {probabilities[best]:.2f}"
            corners = [round(value * to_shown) for value in box.tolist()]
            _draw_box(picture, corners, label, class_colour(detections.classes[best]))
    return picture


def _draw_box(picture: Bytes, corners: list[int], label: str, colour: tuple[int, int, int]) -> None:
    x0, y0, x1, y1 = corners
    cv2.rectangle(picture, (x0, y0), (x1, y1), colour, 2)
    (width, height), _ = cv2.getTextSize(label, _font, _text_scale, 1)
    top = max(y0, height + 8)
    cv2.rectangle(picture, (x0, top - height - 8), (x0 + width + 8, top), colour, cv2.FILLED)
    place = (x0 + 4, top - 5)
    cv2.putText(picture, label, place, _font, _text_scale, (255, 255, 255), 1, cv2.LINE_AA)
