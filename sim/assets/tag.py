"""Tags of the AprilTag family 36h11 as plates that hang on walls."""

from __future__ import annotations

import cv2
import numpy as np

from sim.assets.asset import Asset, Part
from sim.assets.furniture_parts import furniture
from sim.assets.surface import box
from sim.assets.texture import Texture

_cells = 8
"""Of the black square along a side."""
_cell_px = 16
_thickness = 0.005


def make_tag(number: int, side: float) -> Asset:
    """A plate whose front is towards +x and whose middle is at the origin.

    Args:
        number: of the tag in its family.
        side: of the black square, without the white rim of one cell [m].
    """
    whole = side * (_cells + 2) / _cells
    plate = box(_thickness, whole, whole).at((-_thickness / 2, 0, 0))
    return furniture("tag", [Part(plate, texture=tag_texture(number), roughness=1.0)])


def tag_texture(number: int) -> Texture:
    """The tag with its rim, (160, 160, 3)."""
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    code = cv2.aruco.generateImageMarker(family, number, _cells * _cell_px)
    framed = np.pad(np.asarray(code, np.uint8), _cell_px, constant_values=255)
    return np.repeat(framed[..., None], 3, axis=2)
