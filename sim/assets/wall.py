"""Free-standing walls of gardens and yards: brick, plaster, concrete or rough stone under a cap.

The walls of rooms are none of these: they are the background of every indoor picture, and a box
around them would say nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble, box_shape
from sim.assets.building import BRICK
from sim.assets.surface import Surface, box
from sim.assets.texture import Color, Texture, bricks, fractal, mixed, mottled, pick, shade

PLASTER: list[Color] = [(0.85, 0.82, 0.75), (0.75, 0.62, 0.45), (0.62, 0.61, 0.58),
                        (0.78, 0.78, 0.78)]  # fmt: skip
CAPS: list[Color] = [(0.55, 0.54, 0.52), (0.40, 0.22, 0.16), (0.72, 0.70, 0.66)]


def make_wall(rng: Generator) -> Asset:
    """A wall of 2.5 to 5 m along y, 1.0 to 2 m high, with pillars at its ends now and then."""
    length, height, depth = rng.uniform(2.5, 5), rng.uniform(1.0, 2.0), 0.25
    texture = _face(rng)
    body = _body(depth, length, height).at((0, 0, height / 2))
    cap = box(depth + 0.08, length + 0.08, 0.08).at((0, 0, height + 0.04))
    stone = pick(rng, CAPS, 0.02)
    parts = [Part(body, texture=texture), Part(cap, stone)]
    if rng.random() < 0.4:
        parts += _pillars(length, height, depth + 0.12, texture, stone)
    shape = box_shape((-depth / 2, -length / 2, 0), (depth / 2, length / 2, height + 0.08))
    return assemble("wall", parts, [shape])


def _body(depth: float, length: float, height: float) -> Surface:
    """A box whose texture repeats every 1.2 m on sides, ends and top alike."""
    plain = box(depth, length, height)
    across = np.repeat([[length, height], [depth, height], [depth, length]], 8, axis=0)
    return Surface(plain.vertices, plain.triangles, plain.uvs * across / 1.2)


def _face(rng: Generator) -> Texture:
    kind = rng.random()
    if kind < 0.45:
        return bricks(rng, pick(rng, BRICK, 0.03), (0.68, 0.65, 0.6), 16, 128)
    if kind < 0.7:
        return mottled(rng, pick(rng, PLASTER, 0.03), 0.06, 128)
    grey = pick(rng, [(0.50, 0.48, 0.44), (0.58, 0.52, 0.42)], 0.03)
    if kind < 0.85:
        return bricks(rng, grey, shade(grey, 0.55), 8, 128)
    stones = np.clip(np.abs(fractal(rng, 128, 0.9)) * 3, 0, 1)
    return mixed(stones, shade(grey, 0.5), shade(grey, 1.15))


def _pillars(
    length: float, height: float, wide: float, texture: Texture, stone: Color
) -> list[Part]:
    parts: list[Part] = []
    for side in (-1, 1):
        at = (0, side * (length / 2 - wide / 2), height / 2 + 0.08)
        shaft = box(wide, wide, height + 0.16).tiled(0.3, height / 1.2).at(at)
        top = box(wide + 0.08, wide + 0.08, 0.06).at((0, at[1], height + 0.18))
        parts += [Part(shaft, texture=texture), Part(top, stone)]
    return parts
