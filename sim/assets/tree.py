"""Trees: broad crowns of displaced balls, or conifers of stacked skirts."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble, cylinder_shape
from sim.assets.surface import Floats, Surface, ball, join, lathe
from sim.assets.texture import Color, Texture, fractal, hsv, mixed, pick, shade

BARK: list[Color] = [(0.36, 0.25, 0.16), (0.28, 0.20, 0.14), (0.45, 0.38, 0.30), (0.70, 0.68, 0.62)]


def make_tree(rng: Generator) -> Asset:
    """A tree of 2.8 to 5 m with a trunk of 0.1 to 0.22 m radius."""
    radius = rng.uniform(0.10, 0.22)
    leaves = _leaves(rng)
    parts = _conifer(rng, radius, leaves) if rng.random() < 0.3 else _broad(rng, radius, leaves)
    return assemble("tree", parts, [cylinder_shape(radius * 1.15, 0.0, 2.5)])


def _leaves(rng: Generator) -> Texture:
    color = hsv(rng.uniform(0.20, 0.37), rng.uniform(0.5, 0.8), rng.uniform(0.35, 0.6))
    if rng.random() < 0.12:
        color = hsv(rng.uniform(0.03, 0.13), 0.75, rng.uniform(0.55, 0.75))
    patches = 0.5 + 0.35 * fractal(rng, 64, 0.35)
    return mixed(patches, shade(color, 0.4), shade(color, 1.25))


def _trunk(rng: Generator, radius: float, height: float) -> Part:
    levels = np.array([0.0, 0.06, 0.3, 0.65, 1.0])
    widths = radius * np.array([1.5, 1.1, 0.95, 0.8, 0.45])
    surface = lathe(np.stack([widths, levels * height], axis=1), 10)
    bent = surface.vertices.copy()
    phase = rng.uniform(0, 6, 2)
    bent[:, :2] += 0.06 * np.sin(bent[:, 2:] * 1.4 + phase) * (bent[:, 2:] > 0.1)
    color = pick(rng, BARK, 0.03)
    grain = np.repeat(fractal(rng, 64, 0.4)[:16], 4, axis=0)
    bark = mixed(0.55 + 0.3 * grain, shade(color, 0.45), shade(color, 1.1))
    return Part(Surface(bent, surface.triangles, surface.uvs).tiled(2, 2), texture=bark)


def _broad(rng: Generator, radius: float, leaves: Texture) -> list[Part]:
    clear = rng.uniform(1.1, 1.9)
    spread = rng.uniform(0.75, 1.15)
    blobs = [_blob(rng, spread * 0.95, np.array([0, 0, clear + 1.25 * spread]))]
    for index in range(int(rng.integers(5, 8))):
        angle = index * 2.4 + rng.uniform(-0.3, 0.3)
        reach, lift = spread * rng.uniform(0.5, 0.8), spread * rng.uniform(0.55, 1.7)
        center = np.array([reach * math.cos(angle), reach * math.sin(angle), clear + lift])
        blobs.append(_blob(rng, spread * rng.uniform(0.5, 0.7), center))
    crown = [Part(blob.tiled(3, 2), texture=leaves) for blob in blobs]
    return [_trunk(rng, radius, clear + spread), *_merged(crown)]


def _blob(rng: Generator, radius: float, center: Floats) -> Surface:
    """A ball with bumps, like a clump of foliage."""
    sphere = ball(1.0, 2)
    waves = sum(
        np.sin(sphere.vertices @ rng.normal(0, f, 3) + rng.uniform(0, 6)) for f in (3, 5, 9)
    )
    swell = 1 + 0.10 * np.asarray(waves) + 0.05 * rng.normal(size=len(sphere.vertices))
    bumpy = sphere.vertices * swell[:, None] * radius * np.array([1, 1, 0.88]) + center
    return Surface(bumpy, sphere.triangles, sphere.uvs)


def _merged(parts: list[Part]) -> list[Part]:
    return [Part(join([part.surface for part in parts]), texture=parts[0].texture, roughness=1.0)]


def _conifer(rng: Generator, radius: float, leaves: Texture) -> list[Part]:
    clear, height = rng.uniform(0.5, 0.9), rng.uniform(3.2, 4.8)
    width, count = rng.uniform(0.8, 1.2), int(rng.integers(4, 7))
    skirts: list[Part] = []
    for index in range(count):
        low = clear + (height - clear) * index / count * 0.92
        high = min(height, low + (height - clear) / count * 1.75)
        wide = width * (1 - 0.8 * index / count)
        skirts.append(Part(_skirt(rng, wide, low, high).tiled(4, 2), texture=leaves))
    return [_trunk(rng, radius, height * 0.8), *_merged(skirts)]


def _skirt(rng: Generator, radius: float, low: float, high: float) -> Surface:
    profile = [
        (radius * 0.45, low + 0.1),
        (radius, low),
        (radius * 0.5, (low + high) / 2),
        (0.02, high),
    ]
    surface = lathe(profile, 18)
    ragged = surface.vertices.copy()
    ragged[:, :2] *= 1 + 0.12 * np.sin(
        9 * np.arctan2(ragged[:, 1:2], ragged[:, :1]) + rng.uniform(0, 6)
    )
    ragged[:, 2] += 0.05 * rng.normal(size=len(ragged)) * 0.5
    return Surface(ragged, surface.triangles, surface.uvs)
