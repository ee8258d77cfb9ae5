"""Buildings: boxes under brick, plaster or concrete with windows, doors and roofs."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from PIL import Image, ImageDraw

from sim.assets.asset import Asset, Part, assemble, box_shape
from sim.assets.surface import Surface, box, join, loft
from sim.assets.texture import (
    Color,
    Texture,
    bricks,
    from_image,
    mottled,
    pick,
    shade,
    to_rgb8,
)  # fmt: skip

BRICK: list[Color] = [
    (0.55, 0.25, 0.18),
    (0.48, 0.22, 0.16),
    (0.62, 0.40, 0.28),
    (0.70, 0.60, 0.45),
]
PLASTER: list[Color] = [
    (0.85, 0.80, 0.70),
    (0.75, 0.75, 0.76),
    (0.80, 0.65, 0.45),
    (0.65, 0.72, 0.75),
]
FRAME: list[Color] = [(0.92, 0.92, 0.90), (0.25, 0.20, 0.16), (0.15, 0.30, 0.25)]
BAY = 2.4
"""Width of wall that carries one window [m]."""
STOREY = 3.0


def make_building(rng: Generator) -> Asset:
    """A house of 5 to 9 m by 4 to 7 m with one to three storeys and a door at -x."""
    bays = int(rng.integers(2, 4)), int(rng.integers(2, 4))
    storeys = int(rng.integers(1, 4))
    length, depth, height = bays[0] * BAY, bays[1] * BAY, storeys * STOREY
    facade = _facade(rng)
    walls = _walls(bays, storeys)
    roof = (
        _gable(rng, length, depth, height)
        if rng.random() < 0.5
        else _flat(rng, length, depth, height)
    )
    door_color = pick(rng, [(0.30, 0.18, 0.10), (0.1, 0.25, 0.4), (0.5, 0.1, 0.1)], 0.03)
    door = Part(box(0.1, 1.1, 2.2).at((-length / 2, 0, 1.1)), door_color)
    step = Part(box(0.6, 1.7, 0.15).at((-length / 2 - 0.3, 0, 0.075)), (0.55, 0.54, 0.52))
    plinth = Part(box(length + 0.1, depth + 0.1, 0.35).at((0, 0, 0.175)), (0.42, 0.41, 0.40))
    shape = box_shape((-length / 2, -depth / 2, 0), (length / 2, depth / 2, height))
    return assemble("building", [Part(walls, texture=facade), *roof, door, step, plinth], [shape])


def _walls(bays: tuple[int, int], storeys: int) -> Surface:
    """Four walls whose texture repeats once a bay and once a storey."""
    x, y = bays[0] * BAY / 2, bays[1] * BAY / 2
    corners = [(-x, -y), (x, -y), (x, y), (-x, y)]
    sides: list[Surface] = []
    for index, (start, end) in enumerate(zip(corners, corners[1:] + corners[:1], strict=True)):
        repeat = bays[index % 2]
        quad = [(*start, 0), (*end, 0), (*end, storeys * STOREY), (*start, storeys * STOREY)]
        uvs = np.array([(0, storeys), (repeat, storeys), (repeat, 0), (0, 0)], float)
        sides.append(Surface(np.array(quad, float), np.array([[0, 1, 2], [0, 2, 3]]), uvs))
    return join(sides)


def _facade(rng: Generator) -> Texture:
    """One bay of wall, 2.4 x 3 m, with its window."""
    if rng.random() < 0.6:
        brick = pick(rng, BRICK, 0.03)
        wall = bricks(rng, brick, pick(rng, [(0.72, 0.68, 0.62), (0.5, 0.48, 0.45)]), 32, 256)
    else:
        wall = mottled(rng, pick(rng, PLASTER, 0.03), 0.04, 256)
    image = Image.fromarray(wall)
    _window(ImageDraw.Draw(image), rng)
    return from_image(image)


def _window(draw: ImageDraw.ImageDraw, rng: Generator) -> None:
    half, top, low = (
        int(rng.integers(40, 60)),
        int(rng.integers(50, 70)),
        int(rng.integers(155, 185)),
    )
    frame = to_rgb8(pick(rng, FRAME, 0.02))
    glass = to_rgb8(shade((0.28, 0.36, 0.45), rng.uniform(0.5, 1.2)))
    left, right = 128 - half, 128 + half
    draw.rectangle((left - 8, top - 8, right + 8, low + 8), fill=frame)
    draw.rectangle((left - 16, low + 8, right + 16, low + 17), fill=(150, 148, 142))
    draw.rectangle((left, top, right, low), fill=glass)
    bright = tuple(min(255, c + 45) for c in glass)
    draw.polygon([(left, top), (128, top), (left, (top + low) // 2)], fill=bright)
    draw.rectangle((126, top, 130, low), fill=frame)
    draw.rectangle((left, (top + low) // 2 - 2, right, (top + low) // 2 + 2), fill=frame)


def _flat(rng: Generator, length: float, depth: float, height: float) -> list[Part]:
    color = pick(rng, [(0.75, 0.73, 0.68), (0.35, 0.35, 0.36)], 0.03)
    return [Part(box(length + 0.4, depth + 0.4, 0.3).at((0, 0, height + 0.1)), color)]


def _gable(rng: Generator, length: float, depth: float, height: float) -> list[Part]:
    color = pick(rng, [(0.45, 0.18, 0.12), (0.25, 0.25, 0.28), (0.36, 0.26, 0.20)], 0.03)
    rise, y = depth * rng.uniform(0.25, 0.4), depth / 2 + 0.3
    outline = [(-y, height - 0.05), (y, height - 0.05), (0.0, height + rise)]
    ends = [[(x, a, z) for a, z in outline] for x in (-length / 2 - 0.25, length / 2 + 0.25)]
    tiles = bricks(rng, color, shade(color, 0.6), 16, 128)
    return [Part(loft(np.array(ends)).tiled(2, 5), texture=tiles)]
