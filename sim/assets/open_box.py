"""Open boxes that one can look into: cardboard with flaps, plastic crates, wooden trays."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, CollisionShape, Part, assemble, box_shape
from sim.assets.surface import box
from sim.assets.texture import Color, Texture, fractal, mixed, mottled, pick, shade

CARDBOARD: list[Color] = [(0.66, 0.50, 0.32), (0.58, 0.42, 0.26), (0.72, 0.58, 0.40)]
PLASTIC: list[Color] = [(0.08, 0.22, 0.55), (0.45, 0.46, 0.48), (0.65, 0.10, 0.08),
                        (0.10, 0.38, 0.20), (0.85, 0.65, 0.10)]  # fmt: skip
WOOD: list[Color] = [(0.62, 0.45, 0.27), (0.50, 0.34, 0.19)]

Size = tuple[float, float, float]


def make_box(rng: Generator) -> Asset:
    """A box of about 0.34 x 0.34 x 0.22 m, open above, with room for things inside."""
    size = (rng.uniform(0.30, 0.44), rng.uniform(0.30, 0.40), rng.uniform(0.18, 0.27))
    kind = rng.random()
    if kind < 0.55:
        parts, wall = _cardboard(rng, size), 0.008
    elif kind < 0.85:
        parts, wall = _plastic(rng, size), 0.012
    else:
        parts, wall = _wooden(rng, size), 0.016
    return assemble("box", parts, _shapes(size, wall))


def _shapes(size: Size, wall: float) -> list[CollisionShape]:
    """Floor and four walls, so that things can lie inside."""
    return [box_shape(low, high) for low, high in _panels(size, wall)]


def _panels(size: Size, wall: float) -> list[tuple[Size, Size]]:
    """Lowest and highest corners of floor and walls."""
    a, b, z = size[0] / 2, size[1] / 2, size[2]
    return [
        ((-a, -b, 0.0), (a, b, wall)),
        ((-a, -b, 0.0), (wall - a, b, z)),
        ((a - wall, -b, 0.0), (a, b, z)),
        ((-a, -b, 0.0), (a, wall - b, z)),
        ((-a, b - wall, 0.0), (a, b, z)),
    ]


def _tub(size: Size, wall: float, texture: Texture, inside: float) -> list[Part]:
    """The five panels; inside, light comes from above only, and it is darker."""
    parts: list[Part] = []
    for low, high in _panels(size, wall):
        extent, middle = np.subtract(high, low), np.add(high, low) / 2
        parts.append(Part(box(*extent.tolist()).at(middle), texture=texture))
    a, b, z = size[0] - 2 * wall - 0.001, size[1] - 2 * wall - 0.001, size[2] * 0.55
    lining = [((a, 0.002, z), (0, s * b / 2, wall + z / 2)) for s in (-1, 1)]
    lining += [((0.002, b, z), (s * a / 2, 0, wall + z / 2)) for s in (-1, 1)]
    lining.append(((a, b, 0.002), (0, 0, wall)))
    dark = (inside, inside, inside)
    return parts + [Part(box(*extent).at(at), dark, texture) for extent, at in lining]


def _cardboard(rng: Generator, size: Size) -> list[Part]:
    color = pick(rng, CARDBOARD, 0.02)
    board = mottled(rng, color, 0.05)
    parts = _tub(size, 0.008, board, rng.uniform(0.55, 0.8))
    if rng.random() < 0.75:
        parts += _flaps(rng, size, board)
    if rng.random() < 0.5:
        parts += _marks(size, pick(rng, [(0.15, 0.12, 0.10), (0.55, 0.10, 0.08)], 0.02))
    return parts


def _flaps(rng: Generator, size: Size, board: Texture) -> list[Part]:
    """Flaps folded outwards at their own angles; now and then one is missing."""
    x, y, z = size
    parts: list[Part] = []
    for side in (-1, 1):
        for along_x in (True, False):
            reach, droop = rng.uniform(0.10, 0.16), rng.uniform(-0.5, 1.2)
            if rng.random() < 0.1:
                continue
            out, up = reach / 2 * math.cos(droop), -reach / 2 * math.sin(droop)
            if along_x:
                flap = box(reach, y * 0.98, 0.006).at(
                    (side * (x / 2 + out), 0, z + up), (0, side * droop, 0)
                )
            else:
                flap = box(x * 0.98, reach, 0.006).at(
                    (0, side * (y / 2 + out), z + up), (-side * droop, 0, 0)
                )
            parts.append(Part(flap, texture=board))
    return parts


def _marks(size: Size, ink: Color) -> list[Part]:
    """Printed squares on two sides."""
    x, y, z = size
    return [
        Part(box(0.002, 0.06, 0.06).at((s * (x / 2 + 0.001), y * 0.25, z * 0.6)), ink)
        for s in (-1, 1)
    ]


def _plastic(rng: Generator, size: Size) -> list[Part]:
    color = pick(rng, PLASTIC, 0.03)
    parts = _tub(size, 0.012, mottled(rng, color, 0.02), 0.6)
    parts += _rim(size, 0.03, 0.03, shade(color, 0.85))
    x, y, z = size
    for side in (-1, 1):
        grip = box(0.006, y * 0.28, 0.03).at((side * (x / 2 + 0.001), 0, z * 0.72))
        parts.append(Part(grip, shade(color, 0.3)))
        for offset in (-0.3, 0.0, 0.3):
            rib = box(0.02, 0.012, z * 0.9).at((offset * x, side * (y / 2 + 0.004), z * 0.45))
            parts.append(Part(rib, shade(color, 0.8)))
    return parts


def _rim(size: Size, wide: float, high: float, color: Color) -> list[Part]:
    """A frame around the upper edge, open in the middle."""
    x, y, z = size
    bars = [((x + 0.02, wide, high), (0, s * (y - wide + 0.02) / 2, z)) for s in (-1, 1)]
    bars += [((wide, y + 0.02, high), (s * (x - wide + 0.02) / 2, 0, z)) for s in (-1, 1)]
    return [Part(box(*extent).at(_below(at, high)), color, roughness=0.5) for extent, at in bars]


def _below(at: Sequence[float], high: float) -> tuple[float, float, float]:
    return at[0], at[1], at[2] - high / 2


def _wooden(rng: Generator, size: Size) -> list[Part]:
    wood = pick(rng, WOOD, 0.03)
    boards = np.tile((np.arange(64)[:, None] % 21 < 2), (1, 64))
    grain = np.repeat(fractal(rng, 64, 0.6)[:16], 4, axis=0)
    texture = mixed(0.75 + 0.15 * grain - 0.7 * boards, shade(wood, 0.35), shade(wood, 1.1))
    x, y, z = size
    parts = _tub(size, 0.016, texture, 0.65)
    for a in (-1, 1):
        for b in (-1, 1):
            post = box(0.03, 0.03, z).at((a * (x / 2 - 0.02), b * (y / 2 - 0.02), z / 2))
            parts.append(Part(post, shade(wood, 0.8)))
    return parts
