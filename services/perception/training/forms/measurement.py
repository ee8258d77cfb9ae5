"""How well the forms of objects place them, on pictures of looks and scenes that were not learned.

An object counts as whole where the picture does not cut it: of what is cut off nobody knows the
middle. Things of more than `small` metres are reported apart, as a car's middle is far from what
is seen of it.
"""

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from schemas.arrays import Flags, Floats
from services.perception.space.facing import facing_of
from services.perception.space.forms import Forms, Placed
from services.perception.space.surface import MEASURES
from services.perception.training.forms.fit import Example

small = 1.2
"""Longest side of what counts as small [m]."""
ranges: tuple[tuple[float, float], ...] = ((0.3, 1.5), (1.5, 2.5), (2.5, 4.5), (4.5, 7.0))
"""From the camera [m]."""
_within_95 = 7.815
"""What 95 % of a squared normalised error of three dimensions lie below."""
_long = 1.5
"""Length by width from which on a thing has a direction."""


class Placing(Struct, frozen=True, kw_only=True):
    """Objects of one kind at one range."""

    kind: str
    nearest_m: float
    farthest_m: float
    count: int
    error_m: float
    """Mean error of the centre."""
    median_m: float
    error_of_range: float
    """Mean of the error by the range."""
    consistent: float
    """Share of normalised squared errors within their 95 % band; 0.95 would be right."""
    size_m: float
    """Median error of the worst side."""
    yaw_deg: float
    """Median error of the direction of long things; 0 where there are none."""


def placings_of(examples: Sequence[Example], forms: Forms) -> list[Placing]:
    """One for small and one for large things at every range, whole things alone."""
    whole = [one for one in examples if _is_whole(one)]
    found: list[Placing] = []
    for kind in ("small", "large"):
        own = [one for one in whole if (one.size.max() <= small) == (kind == "small")]
        for low, high in ranges:
            some = [one for one in own if low <= _range_of(one) < high]
            if some:
                found.append(_placing(kind, (low, high), some, forms))
    return found


def _placing(
    kind: str, limits: tuple[float, float], examples: Sequence[Example], forms: Forms
) -> Placing:
    placed = [forms.place(one.surface, one.label) for one in examples]
    errors = np.array([one.center for one in placed]) - [one.center for one in examples]
    squared = np.array(
        [
            error @ np.linalg.solve(one.covariance, error)
            for error, one in zip(errors, placed, strict=True)
        ]
    )
    sizes = [np.abs(one.size - true.size).max() for one, true in zip(placed, examples, strict=True)]
    distance, off = np.linalg.norm(errors, axis=1), _turned(examples, placed)
    return Placing(
        kind=kind,
        nearest_m=limits[0],
        farthest_m=limits[1],
        count=len(examples),
        error_m=_rounded(distance.mean()),
        median_m=_rounded(np.median(distance)),
        error_of_range=_rounded((distance / [_range_of(one) for one in examples]).mean()),
        consistent=_rounded((squared < _within_95).mean()),
        size_m=_rounded(np.median(sizes)),
        yaw_deg=_rounded(math.degrees(float(np.median(off)))) if len(off) else 0.0,
    )


def _turned(examples: Sequence[Example], placed: Sequence[Placed]) -> Floats:
    """Errors of the direction of long things [rad]."""
    off: list[float] = []
    for one, box in zip(examples, placed, strict=True):
        if one.size[0] < _long * one.size[1]:
            continue
        facing = facing_of(one.surface.points, box.center, box.size, one.surface.depth)
        off.append(abs((facing.yaw - one.yaw + math.pi / 2) % math.pi - math.pi / 2))
    return np.array(off)


def _is_whole(example: Example) -> bool:
    cut: Flags = example.surface.measures[[MEASURES.index(name) for name in _cuts]] > 0
    return not bool(cut.any())


_cuts = ("cut_x", "cut_top", "cut_bottom")


def _range_of(example: Example) -> float:
    """Of the surface from the camera, along its axis [m]."""
    return example.surface.depth


def _rounded(value: float | np.floating) -> float:
    return round(float(value), 4)
