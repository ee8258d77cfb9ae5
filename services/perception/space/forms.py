"""Where the middle of an object lies behind the surface that is seen, and how large it is.

The half that no camera sees is guessed from what things of a class are like: linear in the measures
of the surface, with a deviation that grows with the range, with what the picture's edge cuts off
and with what is hidden. Learned from rendered things whose true places are known
(`services.perception.training.forms.fit`); classes that were not learned have the form of "any".
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from msgspec import Struct

from schemas.arrays import Floats
from services.perception.errors import PerceptionError
from services.perception.space.surface import MEASURES, Surface

ANY = "any"
DOUBTS = ("one", "range", "cut_x", "cut_y", "hidden")
"""What the variance of a place is linear in, with weights that are not negative: the squares of

    one           1
    range         of the surface [m]
    cut_x         1 where the picture's left or right edge cuts the object, else 0
    cut_y         likewise the upper or lower edge
    hidden        share of the box that the surface does not fill, times its width [m]
"""
default_forms = Path(__file__).parent.parent / "weights" / "forms.json"
_least_size = 0.01

Numbers = tuple[float, ...]


class Form(Struct, frozen=True, kw_only=True):
    """What was learned of one class."""

    examples: int
    center: tuple[Numbers, Numbers, Numbers]
    """From the anchor along the view, across it (to the left) and up: weights of the measures."""
    size: tuple[Numbers, Numbers, Numbers]
    """Length, width and height of the box around it: weights of the measures."""
    variance: tuple[Numbers, Numbers, Numbers]
    """Of the centre along, across and up: weights of the doubts."""


class FormTable(Struct, frozen=True, kw_only=True):
    """The file of all forms."""

    source: str
    measures: tuple[str, ...]
    doubts: tuple[str, ...]
    forms: Mapping[str, Form]


@dataclass(frozen=True)
class Placed:
    """An object as the form of its class has it."""

    center: Floats
    """(3,) Base frame [m]."""
    covariance: Floats
    """(3, 3) Of the centre, base frame [m^2]."""
    size: Floats
    """(3,) Length >= width, and height, of the upright box around it [m]."""


class Forms:
    """The forms of all classes as arrays."""

    def __init__(self, table: FormTable) -> None:
        self.table = table
        self._weights = {name: _arrays(form) for name, form in table.forms.items()}

    def place(self, surface: Surface, label: str) -> Placed:
        """The whole object of which a surface is seen."""
        center, size, variance = self._weights.get(label, self._weights[ANY])
        axes = surface.axes
        middle = surface.anchor + axes @ (center @ surface.measures)
        spread = variance @ doubts_of(surface)
        length, width, height = np.maximum(size @ surface.measures, _least_size).tolist()
        return Placed(
            center=middle,
            covariance=axes @ np.diag(spread) @ axes.T,
            size=np.array([max(length, width), min(length, width), height]),
        )


def doubts_of(surface: Surface) -> Floats:
    """(len(DOUBTS),) see `DOUBTS`."""
    named = dict(zip(MEASURES, surface.measures.tolist(), strict=True))
    hidden = (1 - named["fill"]) * named["width"]
    cut_y = max(named["cut_top"], named["cut_bottom"])
    terms = [1.0, surface.depth, named["cut_x"], cut_y, hidden]
    return np.square(np.array(terms))


def _arrays(form: Form) -> tuple[Floats, Floats, Floats]:
    return np.array(form.center), np.array(form.size), np.array(form.variance)


def read_forms(path: Path = default_forms) -> Forms:
    """The forms in a file.

    Raises:
        PerceptionError: it is missing, is no such file, or was made for other measures.
    """
    try:
        table = msgspec.json.decode(path.read_bytes(), type=FormTable)
    except (OSError, msgspec.DecodeError) as error:
        raise PerceptionError(
            f"cannot read the forms of objects from {path}: {error}; "
            "`incognita train forms` makes them"
        ) from error
    if table.measures != MEASURES or table.doubts != DOUBTS or ANY not in table.forms:
        raise PerceptionError(
            f"{path} was made for other measures of surfaces; "
            "`incognita train forms` makes it again"
        )
    return Forms(table)


def write_forms(table: FormTable, path: Path) -> None:
    """Write forms for people and for `read_forms`."""
    path.write_bytes(msgspec.json.format(msgspec.json.encode(table), indent=1) + b"\n")
