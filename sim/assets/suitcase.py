"""Suitcases: hard shells with ribs, soft ones with pockets, leather ones with straps."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, CollisionShape, Part, assemble, box_shape
from sim.assets.shapes import arc, rounded_box, tube
from sim.assets.surface import box, cylinder
from sim.assets.texture import Color, hsv, mottled, pick, shade

CLOTH: list[Color] = [(0.10, 0.12, 0.20), (0.09, 0.09, 0.10), (0.35, 0.08, 0.10),
                      (0.12, 0.25, 0.20), (0.30, 0.30, 0.33)]  # fmt: skip
LEATHER: list[Color] = [(0.42, 0.24, 0.11), (0.55, 0.36, 0.18), (0.28, 0.15, 0.08),
                        (0.20, 0.28, 0.24)]  # fmt: skip
BLACK: Color = (0.06, 0.06, 0.07)
CHROME: Color = (0.65, 0.66, 0.68)
WHEEL = 0.045
"""Height of the body above the floor where it has wheels [m]."""


def make_suitcase(rng: Generator) -> Asset:
    """A suitcase of 0.36 to 0.7 m standing upright, flat sides towards +x and -x."""
    kind = rng.random()
    if kind < 0.5:
        return _hard(rng)
    return _soft(rng) if kind < 0.8 else _leather(rng)


def _hard(rng: Generator) -> Asset:
    x, y, z = rng.uniform(0.20, 0.27), rng.uniform(0.34, 0.46), rng.uniform(0.48, 0.64)
    color = hsv(rng.random(), rng.uniform(0.1, 0.85), rng.uniform(0.25, 0.85))
    middle = WHEEL + z / 2
    shell = rounded_box(x, y, z, 0.05, 0.035).at((0, 0, middle))
    parts = [Part(shell, color, roughness=0.35)]
    for offset in np.linspace(-0.34, 0.34, 6) * y:
        rib = rounded_box(x + 0.014, 0.022, z * 0.82, 0.006, 0.004, 2).at((0, offset, middle))
        parts.append(Part(rib, shade(color, 0.8), roughness=0.35))
    seam = rounded_box(0.014, y + 0.008, z + 0.008, 0.006, 0.03).at((0, 0, middle))
    parts += [Part(seam, BLACK), *_wheels(x, y)]
    return _trolley(rng, parts, (x, y, WHEEL + z))


def _soft(rng: Generator) -> Asset:
    x, y, z = rng.uniform(0.20, 0.26), rng.uniform(0.34, 0.45), rng.uniform(0.45, 0.62)
    cloth = pick(rng, CLOTH, 0.03)
    middle = WHEEL + z / 2
    weave = mottled(rng, cloth, 0.10, roughness=0.4)
    body = rounded_box(x, y, z, 0.04, 0.015).at((0, 0, middle))
    parts = [Part(body.tiled(3, 3), texture=weave)]
    for low, high in ((0.06, 0.55), (0.60, 0.93)):
        pocket = rounded_box(0.05, y * 0.82, (high - low) * z, 0.02, 0.012)
        at = (x / 2, 0, WHEEL + (low + high) / 2 * z)
        parts.append(Part(pocket.at(at), shade(cloth, 1.35)))
        zip_ = box(0.052, y * 0.78, 0.008).at((x / 2 + 0.001, 0, WHEEL + high * z - 0.03))
        parts.append(Part(zip_, pick(rng, [CHROME, BLACK], 0.02)))
    edges = [rounded_box(0.012, y + 0.01, z + 0.01, 0.006, 0.03).at((s * x * 0.36, 0, middle))
             for s in (-1, 1)]  # fmt: skip
    parts += [Part(edge, shade(cloth, 0.5)) for edge in edges]
    return _trolley(rng, [*parts, *_wheels(x, y)], (x, y, WHEEL + z))


def _leather(rng: Generator) -> Asset:
    x, y, z = rng.uniform(0.16, 0.22), rng.uniform(0.45, 0.62), rng.uniform(0.34, 0.44)
    hide = pick(rng, LEATHER, 0.03)
    body = rounded_box(x, y, z, 0.025, 0.012).at((0, 0, z / 2))
    parts = [Part(body.tiled(3, 2), texture=mottled(rng, hide, 0.08), roughness=0.6)]
    for side in (-1, 1):
        strap = box(x + 0.012, 0.035, z + 0.008).at((0, side * y * 0.28, z / 2))
        buckle = box(0.01, 0.05, 0.04).at((x / 2 + 0.006, side * y * 0.28, z * 0.7))
        parts += [Part(strap, shade(hide, 0.55)), Part(buckle, (0.70, 0.60, 0.30), roughness=0.4)]
        for top in (0.03, z - 0.03):
            cap = box(x + 0.008, 0.06, 0.06).at((0, side * (y / 2 - 0.028), top))
            parts.append(Part(cap, shade(hide, 0.7)))
    handle = tube(arc(0.07, 0, math.pi, 8, 0.6)[:, [1, 0, 2]], 0.010, 6, (1, 0, 0))
    parts.append(Part(handle.at((0, 0, z - 0.005)), shade(hide, 0.5)))
    shapes = [box_shape((-x / 2, -y / 2, 0), (x / 2, y / 2, z))]
    return assemble("suitcase", parts, shapes)


def _wheels(x: float, y: float) -> list[Part]:
    places = [(a * x * 0.32, b * y * 0.36) for a in (-1, 1) for b in (-1, 1)]
    wheels = [
        Part(cylinder(0.024, 0.022, 10).at((a, b, 0.024), (math.pi / 2, 0, 0)), BLACK)
        for a, b in places
    ]
    feet = [Part(box(0.035, 0.04, 0.03).at((a, b, WHEEL - 0.005)), BLACK) for a, b in places]
    return wheels + feet


def _trolley(rng: Generator, parts: list[Part], size: tuple[float, float, float]) -> Asset:
    """The case with a carrying handle and, pulled out or not, the bar to draw it by."""
    x, y, z = size
    grip = tube(arc(0.065, 0, math.pi, 7, 0.4)[:, [1, 0, 2]], 0.011, 6, (1, 0, 0))
    parts.append(Part(grip.at((0.02, 0, z - 0.006)), BLACK))
    shapes = [box_shape((-x / 2, -y / 2, 0), (x / 2, y / 2, z))]
    if rng.random() < 0.45:
        bar, shape = _bar(x, y, z, rng.uniform(0.15, 0.36))
        return assemble("suitcase", [*parts, *bar], [*shapes, shape])
    return assemble("suitcase", parts, shapes)


def _bar(x: float, y: float, z: float, reach: float) -> tuple[list[Part], CollisionShape]:
    half, back = y * 0.24, -x * 0.3
    rods = [cylinder(0.007, reach, 6).at((back, s * half, z + reach / 2)) for s in (-1, 1)]
    top = rounded_box(0.028, 2 * half + 0.03, 0.026, 0.01, 0.005).at((back, 0, z + reach))
    parts = [*(Part(rod, CHROME, roughness=0.4) for rod in rods), Part(top, BLACK)]
    low, high = (back - 0.014, -half - 0.015, z), (back + 0.014, half + 0.015, z + reach)
    return parts, box_shape(low, high)
