"""Cars: a lofted body and glasshouse, wheels, lights, bumpers and plates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble, box_shape
from sim.assets.surface import Floats, Surface, box, cylinder, lathe, loft
from sim.assets.texture import Color, pick, shade

PAINTS: list[Color] = [
    (0.10, 0.25, 0.55),
    (0.60, 0.07, 0.07),
    (0.85, 0.85, 0.86),
    (0.08, 0.08, 0.09),
    (0.50, 0.52, 0.55),
    (0.12, 0.35, 0.20),
    (0.80, 0.60, 0.10),
    (0.30, 0.45, 0.60),
]
GLASS: Color = (0.07, 0.09, 0.12)
RUBBER: Color = (0.06, 0.06, 0.06)
LAMP: Color = (0.97, 0.97, 0.88)
TAIL_LAMP: Color = (0.75, 0.03, 0.03)


@dataclass(frozen=True)
class _Shape:
    """Proportions [m]: overall size and, as fractions of the length, where glass and roof lie."""

    length: float
    width: float
    height: float
    belt: float
    windshield: tuple[float, float]
    rear: tuple[float, float]
    tail: float


def make_car(rng: Generator) -> Asset:
    """A saloon, hatchback or van of 3.6 to 4.8 m, front along +x."""
    shape = _shape(rng)
    color = pick(rng, PAINTS, 0.04)
    parts = [*_body(shape, color), *_wheels(rng, shape), *_trim(shape, color)]
    half, side = shape.length / 2, shape.width / 2
    cabin = (-half * 0.85, -side * 0.9, shape.belt), (half * 0.5, side * 0.9, shape.height)
    shapes = [box_shape((-half, -side, 0.15), (half, side, shape.belt)), box_shape(*cabin)]
    return assemble("car", parts, shapes)


def _shape(rng: Generator) -> _Shape:
    width = rng.uniform(1.65, 1.85)
    kind = int(rng.integers(3))
    if kind == 0:
        return _Shape(rng.uniform(4.2, 4.8), width, rng.uniform(1.38, 1.48), 0.90,
                      (0.24, 0.09), (-0.36, -0.22), 0.86)  # fmt: skip
    if kind == 1:
        return _Shape(rng.uniform(3.6, 4.1), width, rng.uniform(1.42, 1.55), 0.92,
                      (0.27, 0.10), (-0.48, -0.40), 0.90)  # fmt: skip
    return _Shape(rng.uniform(4.3, 4.8), width, rng.uniform(1.75, 1.98), 1.05,
                  (0.36, 0.22), (-0.49, -0.47), 1.03)  # fmt: skip


def _body(shape: _Shape, color: Color) -> list[Part]:
    long, belt = shape.length, shape.belt
    stations = [
        (-0.5, 0.34, 0.70, 0.90),
        (-0.49, 0.24, shape.tail, 0.97),
        (-0.36, 0.20, belt, 1.0),
        (0.27, 0.20, belt, 1.0),
        (0.44, 0.22, belt * 0.88, 0.97),
        (0.49, 0.26, belt * 0.76, 0.92),
        (0.5, 0.36, belt * 0.66, 0.86),
    ]
    hull = loft(
        [_section(x * long, low, high, w * shape.width, 0.06) for x, low, high, w in stations]
    )
    (front_low, front_top), (rear_low, rear_top) = shape.windshield, shape.rear
    house = _glasshouse(shape, (rear_low, rear_top, front_top, front_low))
    return [Part(hull, color, roughness=0.25), *house, *_roof(shape, color, rear_top, front_top)]


def _section(x: float, low: float, high: float, width: float, round_: float) -> Floats:
    """A cross-section with its lower and upper corners cut, counter-clockwise seen from +x."""
    half = width / 2
    right = [
        (half - round_, low),
        (half, low + 2 * round_),
        (half, high - 0.22),
        (half * 0.94, high - 0.04),
        (half * 0.86, high),
    ]
    left = [(-y, z) for y, z in reversed(right)]
    return np.array([(x, y, z) for y, z in [*right, *left]])


def _glasshouse(shape: _Shape, stations: Sequence[float]) -> list[Part]:
    """The dark cabin of glass; the roof, pillars and frames are laid over it."""
    low, top = shape.belt - 0.03, shape.height - 0.05
    half, roof_half = shape.width * 0.45, shape.width * 0.36
    xs = [station * shape.length for station in stations]
    base = [(xs[0], -half), (xs[3], -half), (xs[3], half), (xs[0], half)]
    roof = [(xs[1], -roof_half), (xs[2], -roof_half), (xs[2], roof_half), (xs[1], roof_half)]
    rings = np.array([[(x, y, low) for x, y in base], [(x, y, top) for x, y in roof]])
    return [Part(loft(rings), GLASS, roughness=0.1)]


def _roof(shape: _Shape, color: Color, rear: float, front: float) -> list[Part]:
    long, half, top = shape.length, shape.width * 0.365, shape.height
    rim = [(rear * long - 0.03, -half), (front * long + 0.03, -half),
           (front * long + 0.03, half), (rear * long - 0.03, half)]  # fmt: skip
    rings = np.array(
        [[(x * k, y * k, z) for x, y in rim] for k, z in ((1, top - 0.07), (0.93, top))]
    )
    parts = [Part(loft(rings), color, roughness=0.25)]
    for side in (-1, 1):
        for low_x, top_x in _pillars(shape):
            low = np.array([low_x * long, side * shape.width * 0.452, shape.belt - 0.03])
            high = np.array([top_x * long, side * half, top - 0.05])
            parts.append(Part(_beam(low, high, 0.08), color, roughness=0.3))
    return parts


def _pillars(shape: _Shape) -> list[tuple[float, float]]:
    (front_low, front_top), (rear_low, rear_top) = shape.windshield, shape.rear
    middle = (front_top + rear_top) / 2 + 0.02
    return [(front_low, front_top), (middle, middle), (rear_low, rear_top)]


def _beam(start: Floats, end: Floats, width: float) -> Surface:
    along = np.array([width / 2, 0, 0])
    across = np.array([0, 0.025, 0])
    corners = [-along - across, along - across, along + across, -along + across]
    return loft(np.array([[start + c for c in corners], [end + c for c in corners]]))


def _wheels(rng: Generator, shape: _Shape) -> list[Part]:
    radius = rng.uniform(0.29, 0.34)
    tyre = lathe([(radius * 0.7, -0.1), (radius * 0.95, -0.1), (radius, -0.06), (radius, 0.06),
                  (radius * 0.95, 0.1), (radius * 0.7, 0.1)], 18)  # fmt: skip
    rim, hub = cylinder(radius * 0.62, 0.215, 12), cylinder(radius * 0.2, 0.23, 6)
    arch = cylinder(radius * 1.14, 0.12, 18)
    pieces = [(tyre, RUBBER), (rim, (0.65, 0.66, 0.68)), (hub, (0.25, 0.25, 0.26))]
    parts: list[Part] = []
    for x in (-0.30 * shape.length, 0.31 * shape.length):
        for side in (-1, 1):
            at = (x, side * (shape.width / 2 - 0.09), radius)
            inner = (x, side * (shape.width / 2 - 0.055), radius + 0.01)
            turned = (math.pi / 2, 0.0, 0.0)
            parts += [Part(piece.at(at, turned), color) for piece, color in pieces]
            parts.append(Part(arch.at(inner, turned), (0.03, 0.03, 0.03)))
    return parts


def _trim(shape: _Shape, color: Color) -> list[Part]:
    half, wide, belt = shape.length / 2, shape.width, shape.belt
    pieces: list[tuple[tuple[float, float, float], tuple[float, float, float], Color]] = [
        ((0.10, wide * 0.86, 0.16), (half - 0.01, 0, 0.36), (0.10, 0.10, 0.11)),
        ((0.10, wide * 0.88, 0.16), (-half + 0.01, 0, 0.40), (0.10, 0.10, 0.11)),
        ((0.05, wide * 0.42, 0.09), (half - 0.01, 0, belt * 0.60), (0.05, 0.05, 0.06)),
        ((0.02, 0.46, 0.11), (-half - 0.005, 0, 0.60), (0.9, 0.9, 0.85)),
        ((0.02, 0.46, 0.11), (half + 0.045, 0, 0.36), (0.9, 0.9, 0.85)),
    ]
    mirror = shape.windshield[0] * shape.length - 0.12
    for side in (-1, 1):
        pieces += [
            ((0.08, 0.30, 0.12), (half - 0.03, side * wide * 0.33, belt * 0.62), LAMP),
            ((0.08, 0.26, 0.15), (-half + 0.02, side * wide * 0.35, 0.62), TAIL_LAMP),
            ((0.10, 0.16, 0.11), (mirror, side * wide * 0.52, belt + 0.06), color),
            ((0.9, 0.01, 0.02), (0.0, side * wide * 0.5, belt - 0.28), shade(color, 0.6)),
        ]
    return [Part(box(*size).at(at), paint, roughness=0.4) for size, at, paint in pieces]
