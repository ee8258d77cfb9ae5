"""What furniture is put together from: blocks, legs, panels, and the materials of indoors."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble, box_shape
from sim.assets.surface import box, cylinder
from sim.assets.texture import Color, Texture, fractal, hsv, mixed, pick, shade

WOODS: list[Color] = [
    (0.62, 0.45, 0.28),
    (0.45, 0.29, 0.16),
    (0.75, 0.62, 0.44),
    (0.32, 0.20, 0.12),
]
WHITE: Color = (0.92, 0.92, 0.90)
GREY: Color = (0.55, 0.56, 0.58)
BLACK: Color = (0.06, 0.06, 0.07)
STEEL: Color = (0.70, 0.71, 0.73)

Point3 = tuple[float, float, float]


def block(size: Point3, at: Point3, color: Color, roughness: float = 0.8) -> Part:
    """A box of a plain colour with its middle at a point [m]."""
    return Part(box(*size).at(at), color, roughness=roughness)


def post(radius: float, low: Point3, height: float, color: Color, roughness: float = 0.5) -> Part:
    """An upright cylinder that stands on a point [m]."""
    x, y, z = low
    return Part(cylinder(radius, height, 10).at((x, y, z + height / 2)), color, roughness=roughness)


def legs(x: float, y: float, height: float, color: Color, side: float = 0.04) -> list[Part]:
    """Four square legs at the corners of a rectangle of half sides x, y [m]."""
    return [
        block((side, side, height), (a * x, b * y, height / 2), color)
        for a in (-1, 1)
        for b in (-1, 1)
    ]


def picture(size: tuple[float, float], at: Point3, texture: Texture) -> Part:
    """A thin upright panel (y, z) that shows a texture towards +x [m]."""
    return Part(box(0.02, *size).at(at), texture=texture, roughness=0.6)


def furniture(label: str, parts: Sequence[Part]) -> Asset:
    """An asset that takes up the box around its parts."""
    vertices = np.concatenate([part.surface.vertices for part in parts])
    return assemble(label, parts, [box_shape(vertices.min(axis=0), vertices.max(axis=0))])


def wood_or_paint(rng: Generator) -> Color:
    """The colour of a front or a table top."""
    plain = [WHITE, (0.80, 0.79, 0.76), (0.35, 0.37, 0.40)]
    return pick(rng, WOODS if rng.random() < 0.55 else plain, 0.03)


def fabric(rng: Generator) -> Color:
    """The colour of a cover."""
    return hsv(rng.random(), rng.uniform(0.05, 0.65), rng.uniform(0.15, 0.75))


def grain(rng: Generator, wood: Color, size: int = 64) -> Texture:
    """Wood with its grain along the rows."""
    lines = fractal(rng, size, 0.9)
    streaks = np.repeat(lines.mean(axis=1, keepdims=True), size, axis=1) * math.sqrt(size)
    return mixed(0.6 + 0.1 * streaks + 0.05 * lines, shade(wood, 0.6), shade(wood, 1.15))


def speckled(rng: Generator, color: Color, contrast: float = 0.15) -> Texture:
    """Stone or laminate."""
    return mixed(0.5 + contrast * rng.normal(size=(32, 32)), shade(color, 0.6), shade(color, 1.3))
