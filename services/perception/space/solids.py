"""What may not be touched: the simple shapes that an object consists of, for planning in contact.

Upright boxes, cylinders and balls, in the frame of the object's own box: x along its length, y
along its width, z up, the origin in its middle.
"""

from dataclasses import dataclass

import numpy as np

from schemas.arrays import Floats

_round = ("cone", "hydrant", "barrel", "tree", "mustard bottle", "pitcher")
_balls = ("ball",)
_open_boxes = ("open box", "box")
_plate = 0.012
"""Of the walls and the floor of an open box [m]."""


@dataclass(frozen=True)
class Solid:
    """One shape."""

    kind: str
    """One of `schemas.perception.SOLID_KINDS`."""
    center: Floats
    """(3,) in the object's frame [m]."""
    size: Floats
    """(3,) [m]; diameter, diameter, height of a cylinder; three times the diameter of a ball."""


def solids_of(label: str, size: Floats) -> list[Solid]:
    """The shapes of an object of a class with a box of size (3,) length, width, height [m]."""
    if label in _open_boxes:
        return _open_box(size)
    middle = np.zeros(3)
    if label in _balls:
        return [Solid("ball", middle, np.full(3, float(size.mean())))]
    if label in _round:
        across = float(size[:2].mean())
        return [Solid("cylinder", middle, np.array([across, across, size[2]]))]
    return [Solid("box", middle, size)]


def _open_box(size: Floats) -> list[Solid]:
    """A floor and four walls: what is inside can be reached from above."""
    length, width, height = size.tolist()
    floor = Solid("box", np.array([0, 0, (_plate - height) / 2]), np.array([length, width, _plate]))
    ends = [
        Solid("box", np.array([x, 0, 0]), np.array([_plate, width, height]))
        for x in ((_plate - length) / 2, (length - _plate) / 2)
    ]
    sides = [
        Solid("box", np.array([0, y, 0]), np.array([length, _plate, height]))
        for y in ((_plate - width) / 2, (width - _plate) / 2)
    ]
    return [floor, *ends, *sides]
