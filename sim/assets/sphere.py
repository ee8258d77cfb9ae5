"""Balls: plain, striped, for tennis, basketball or football."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator
from PIL import Image

from sim.assets.asset import Asset, CollisionShape, Part, assemble
from sim.assets.surface import Floats, lathe
from sim.assets.texture import Color, Texture, from_image, hsv, mixed, mottled, pick

WHITE: Color = (0.94, 0.94, 0.92)
BLACK: Color = (0.06, 0.06, 0.06)
_rows, _columns = 64, 128


def make_ball(rng: Generator) -> Asset:
    """A ball of 0.03 to 0.12 m radius."""
    kinds = (_plain, _beach, _ringed, _tennis, _basketball, _football)
    kind = int(rng.integers(len(kinds)))
    low, high = {3: (0.032, 0.036), 4: (0.09, 0.12), 5: (0.085, 0.115)}.get(kind, (0.03, 0.12))
    radius = rng.uniform(low, high)
    angle = np.linspace(-math.pi / 2, math.pi / 2, 15)
    profile = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    tilt = tuple(rng.uniform(-1.5, 1.5, 3).tolist())
    surface = lathe(profile, 22).at((0, 0, 0), tilt).at((0, 0, radius))
    part = Part(surface, texture=kinds[kind](rng), roughness=0.7 if kind == 3 else 0.4)
    return assemble(
        "ball", [part], [CollisionShape("ball", (0.0, 0.0, radius), (radius, radius, radius))]
    )


def _directions() -> Floats:
    """Unit vector (rows, columns, 3) of every pixel of the texture."""
    latitude = math.pi / 2 - (np.arange(_rows) + 0.5) / _rows * math.pi
    longitude = (np.arange(_columns) + 0.5) / _columns * 2 * math.pi
    level = np.cos(latitude)[:, None]
    x, y = level * np.cos(longitude), level * np.sin(longitude)
    return np.stack([x, y, np.sin(latitude)[:, None] * np.ones(_columns)], axis=-1)


def _bright(rng: Generator) -> Color:
    return hsv(rng.random(), rng.uniform(0.65, 0.95), rng.uniform(0.6, 0.95))


def _plain(rng: Generator) -> Texture:
    return mottled(rng, _bright(rng), 0.03, _rows)


def _beach(rng: Generator) -> Texture:
    """Segments in turn white and coloured."""
    colors = [WHITE, _bright(rng), WHITE, _bright(rng), WHITE, _bright(rng)]
    strip = (np.array(colors)[None] * 255).astype(np.uint8)
    return from_image(Image.fromarray(strip).resize((_columns, _rows), Image.Resampling.NEAREST))


def _ringed(rng: Generator) -> Texture:
    ring = np.abs(_directions()[..., 2]) < rng.uniform(0.15, 0.4)
    return mixed(ring.astype(float), _bright(rng), WHITE if rng.random() < 0.7 else BLACK)


def _tennis(rng: Generator) -> Texture:
    x, y, z = np.moveaxis(_directions(), -1, 0)
    seam = np.abs(z - 0.75 * (x**2 - y**2)) < 0.09
    felt = pick(rng, [(0.74, 0.86, 0.15), (0.80, 0.88, 0.25)], 0.02)
    return mixed(seam.astype(float), felt, WHITE)


def _basketball(rng: Generator) -> Texture:
    x, y, z = np.moveaxis(_directions(), -1, 0)
    line = (
        (np.abs(z) < 0.035) | (np.abs(x) < 0.035) | (np.abs(np.abs(y) - 0.62 + 0.25 * z**2) < 0.03)
    )
    return mixed(
        line.astype(float), pick(rng, [(0.82, 0.36, 0.10), (0.70, 0.28, 0.08)], 0.02), BLACK
    )


def _football(rng: Generator) -> Texture:
    """Twelve dark patches at the corners of an icosahedron."""
    golden = (1 + math.sqrt(5)) / 2
    signs = [(a, b) for a in (-1, 1) for b in (-golden, golden)]
    corners = [p for a, b in signs for p in ((0, a, b), (a, b, 0), (b, 0, a))]
    middles = np.array(corners, float) / math.hypot(1, golden)
    near = (_directions() @ middles.T).max(axis=-1)
    patch = BLACK if rng.random() < 0.6 else _bright(rng)
    return mixed((near > 0.93).astype(float), WHITE, patch)
