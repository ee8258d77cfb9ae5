"""What stands in rooms and is none of the classes: tables, chairs, shelves, cabinets, sofas."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble, box_shape
from sim.assets.shapes import rounded_box
from sim.assets.surface import box, cylinder
from sim.assets.texture import Color, Texture, fractal, hsv, mixed, mottled, pick, shade

WOOD: list[Color] = [(0.55, 0.38, 0.22), (0.36, 0.22, 0.13), (0.72, 0.57, 0.38),
                     (0.80, 0.70, 0.55)]  # fmt: skip
LACQUER: list[Color] = [(0.90, 0.90, 0.88), (0.20, 0.20, 0.22), (0.55, 0.57, 0.58),
                        (0.35, 0.42, 0.48)]  # fmt: skip
STEEL: Color = (0.35, 0.35, 0.37)


def board(rng: Generator) -> Texture:
    """Grained wood or plain lacquer."""
    if rng.random() < 0.35:
        return mottled(rng, pick(rng, LACQUER, 0.02), 0.02)
    wood = pick(rng, WOOD, 0.03)
    grain = np.repeat(fractal(rng, 64, 0.7)[:, :8], 8, axis=1).T
    return mixed(0.65 + 0.14 * grain, shade(wood, 0.6), shade(wood, 1.15))


def make_table(rng: Generator) -> Asset:
    """A table or desk 0.45 to 0.8 m high; its top is the highest face."""
    x, y = rng.uniform(0.6, 0.9), rng.uniform(1.0, 1.7)
    z = rng.uniform(0.68, 0.78) if rng.random() < 0.75 else rng.uniform(0.4, 0.5)
    top = Part(box(x, y, 0.035).at((0, 0, z - 0.0175)), texture=board(rng), roughness=0.6)
    paint = pick(rng, [STEEL, *WOOD[:2], (0.85, 0.85, 0.84)], 0.02)
    legs = [
        Part(box(0.05, 0.05, z - 0.03).at((a * (x / 2 - 0.06), b * (y / 2 - 0.06), z / 2)), paint)
        for a in (-1, 1)
        for b in (-1, 1)
    ]
    apron = Part(box(x - 0.12, y - 0.12, 0.06).at((0, 0, z - 0.065)), shade(paint, 0.8))
    shapes = [box_shape((-x / 2, -y / 2, z - 0.035), (x / 2, y / 2, z))]
    shapes += [
        box_shape((a * x / 2 - 0.05, b * y / 2 - 0.05, 0), (a * x / 2 + 0.05, b * y / 2 + 0.05, z))
        for a, b in ((-0.84, -0.9), (-0.84, 0.9), (0.84, -0.9), (0.84, 0.9))
    ]
    return assemble("table", [top, *legs, apron], shapes)


def make_chair(rng: Generator) -> Asset:
    """A chair with four legs or on a column with wheels, facing +x."""
    paint = hsv(rng.random(), rng.uniform(0, 0.7), rng.uniform(0.15, 0.75))
    seat_height, back = rng.uniform(0.43, 0.48), rng.uniform(0.36, 0.5)
    seat = rounded_box(0.44, 0.44, 0.05, 0.06, 0.015).at((0, 0, seat_height))
    rest = rounded_box(0.05, 0.42, back, 0.02, 0.015)
    rest = rest.at((-0.22, 0, seat_height + 0.08 + back / 2), (0, -0.12, 0))
    stand = _swivel(seat_height) if rng.random() < 0.45 else _legs(rng, seat_height, back)
    shape = box_shape((-0.25, -0.23, 0), (0.23, 0.23, seat_height + 0.08 + back))
    parts = [Part(seat, paint), Part(rest, shade(paint, 0.9)), *stand]
    return assemble("chair", parts, [shape])


def _legs(rng: Generator, height: float, back: float) -> list[Part]:
    wood = pick(rng, [*WOOD, STEEL], 0.02)
    parts = [
        Part(box(0.04, 0.04, height).at((a * 0.19, b * 0.19, height / 2)), wood)
        for a in (-1, 1)
        for b in (-1, 1)
    ]
    posts = [box(0.035, 0.035, back + 0.1).at((-0.20, b * 0.19, height + back / 2), (0, -0.12, 0))
             for b in (-1, 1)]  # fmt: skip
    return parts + [Part(post, wood) for post in posts]


def _swivel(height: float) -> list[Part]:
    parts = [Part(cylinder(0.03, height - 0.08, 8).at((0, 0, height / 2 + 0.02)), STEEL)]
    for index in range(5):
        angle = index * 2 * math.pi / 5
        out = (0.14 * math.cos(angle), 0.14 * math.sin(angle), 0.09)
        end = (0.27 * math.cos(angle), 0.27 * math.sin(angle), 0.035)
        parts.append(Part(box(0.28, 0.035, 0.03).at(out, (0, 0, angle)), (0.08, 0.08, 0.08)))
        wheel = cylinder(0.035, 0.03, 8).at(end, (math.pi / 2, 0, angle))
        parts.append(Part(wheel, (0.05, 0.05, 0.05)))
    return parts


def make_shelf(rng: Generator) -> Asset:
    """A shelf with books and files, its back towards -x."""
    wide, high, deep = rng.uniform(0.7, 1.1), rng.uniform(1.2, 2.0), 0.30
    wood = board(rng)
    levels = np.linspace(0.05, high - 0.015, int(high / 0.36) + 1)
    panels = [box(deep, wide, 0.025).at((0, 0, level)) for level in levels]
    panels += [box(deep, 0.025, high).at((0, s * wide / 2, high / 2)) for s in (-1, 1)]
    panels.append(box(0.01, wide, high).at((-deep / 2, 0, high / 2)))
    parts = [Part(panel, texture=wood) for panel in panels]
    for level in levels[:-1]:
        parts += _books(rng, wide, float(level) + 0.0125)
    shape = box_shape((-deep / 2, -wide / 2, 0), (deep / 2, wide / 2, high))
    return assemble("shelf", parts, [shape])


def _books(rng: Generator, wide: float, level: float) -> list[Part]:
    """A row of spines that fills a part of one board."""
    parts: list[Part] = []
    y, end = -wide / 2 + 0.03, wide / 2 - rng.uniform(0.05, 0.5) * wide
    while y < end:
        thick, tall = rng.uniform(0.025, 0.06), rng.uniform(0.18, 0.28)
        color = hsv(rng.random(), rng.uniform(0.1, 0.7), rng.uniform(0.15, 0.75))
        spine = box(rng.uniform(0.16, 0.22), thick * 0.94, tall)
        parts.append(Part(spine.at((0.0, y + thick / 2, level + tall / 2)), color))
        y += thick
    return parts


def make_cabinet(rng: Generator) -> Asset:
    """A cupboard or a chest with doors towards +x."""
    deep, wide = rng.uniform(0.4, 0.55), rng.uniform(0.6, 1.2)
    high = rng.uniform(0.7, 0.95) if rng.random() < 0.6 else rng.uniform(1.5, 2.0)
    wood, handle = board(rng), pick(rng, [(0.75, 0.75, 0.76), (0.1, 0.1, 0.1)], 0.02)
    parts = [Part(box(deep, wide, high).at((0, 0, high / 2)), texture=wood)]
    columns, rows = int(rng.integers(1, 4)), int(rng.integers(1, 4))
    w, h = wide / columns, high / rows
    for column in range(columns):
        for row in range(rows):
            middle = (deep / 2 + 0.006, (column + 0.5) * w - wide / 2, (row + 0.5) * h)
            parts.append(Part(box(0.02, w * 0.93, h * 0.93).at(middle), (0.92, 0.92, 0.92), wood))
            grip = box(0.02, 0.10, 0.015).at((deep / 2 + 0.025, middle[1], middle[2] + 0.3 * h))
            parts.append(Part(grip, handle, roughness=0.4))
    shape = box_shape((-deep / 2, -wide / 2, 0), (deep / 2, wide / 2, high))
    return assemble("cabinet", parts, [shape])


def make_sofa(rng: Generator) -> Asset:
    """A sofa for two or an armchair, facing +x."""
    wide = rng.uniform(0.85, 1.0) if rng.random() < 0.4 else rng.uniform(1.4, 1.8)
    color = hsv(rng.random(), rng.uniform(0.05, 0.55), rng.uniform(0.2, 0.7))
    cloth = mottled(rng, color, 0.06, roughness=0.5)
    blocks = [
        rounded_box(0.8, wide, 0.40, 0.05, 0.03).at((0, 0, 0.22)),
        rounded_box(0.22, wide, 0.50, 0.06, 0.04).at((-0.32, 0, 0.58)),
        *(rounded_box(0.8, 0.16, 0.58, 0.05, 0.04).at((0, s * wide / 2, 0.30)) for s in (-1, 1)),
    ]
    shape = box_shape((-0.43, -wide / 2 - 0.08, 0), (0.4, wide / 2 + 0.08, 0.83))
    return assemble("sofa", [Part(block.tiled(3, 2), texture=cloth) for block in blocks], [shape])
