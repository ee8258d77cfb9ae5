"""What makes a camera frame useless, found before anything is recognised in it."""

import math

import numpy as np
from numpy.typing import NDArray

from schemas.sensing import RgbdFrame
from services.perception.errors import UnusablePictureError

_least_side = 16
"""Nothing can be recognised in less [px]."""
_darkest = 8
"""A picture without any brighter value than this, of 255, shows nothing."""
_blank_share = 0.25
"""A picture that was cut short ends in at least this part of one plain colour."""


def require_sound(frame: RgbdFrame) -> None:
    """Refuse a frame in which nothing can be recognised.

    Raises:
        UnusablePictureError: the text says what is wrong.
    """
    flaw = _flaw_of_arrays(frame) or _flaw_of_camera(frame) or _flaw_of_picture(frame.color)
    if flaw:
        raise UnusablePictureError(flaw)


def _flaw_of_arrays(frame: RgbdFrame) -> str:
    color, depth = frame.color, frame.depth_mm
    if color.dtype != np.uint8 or color.ndim != 3 or color.shape[2] != 3:
        return f"the picture is {color.dtype} {color.shape}; allowed is RGB, uint8 (H, W, 3)"
    if depth.dtype != np.uint16 or depth.shape != color.shape[:2]:
        return (
            f"the depth is {depth.dtype} {depth.shape}; "
            f"to this picture belongs uint16 {color.shape[:2]}, in millimetres"
        )
    if min(depth.shape) < _least_side:
        return f"the picture is {depth.shape[1]}x{depth.shape[0]} px, too small to show anything"
    return ""


def _flaw_of_camera(frame: RgbdFrame) -> str:
    camera, (height, width) = frame.intrinsics, frame.color.shape[:2]
    if (camera.width, camera.height) != (width, height):
        return (
            f"the picture is {width}x{height} px, "
            f"its camera is said to take {camera.width}x{camera.height}"
        )
    lengths = (camera.fx, camera.fy)
    if not all(math.isfinite(length) and length > 0 for length in lengths):
        return f"the focal lengths are {camera.fx} and {camera.fy} px; allowed are positive numbers"
    return ""


def _flaw_of_picture(color: NDArray[np.uint8]) -> str:
    if int(color.max()) <= _darkest:
        return "the picture is black: the lens is covered, or the camera is off"
    rows = max(1, round(_blank_share * len(color)))
    if (color[-rows:] != color[-1, -1]).any():
        return ""
    blank = (color == color[-1, -1]).all(axis=(1, 2))
    if not blank.all():
        first = len(color) - int(np.argmin(blank[::-1]))
        return f"the picture is cut short: nothing came below row {first} of {len(color)}"
    return ""
