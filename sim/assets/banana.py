"""Bananas: single or a small bunch, lying on their side."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, CollisionShape, Part, assemble, box_shape
from sim.assets.shapes import tube
from sim.assets.surface import Floats, Surface
from sim.assets.texture import Color, Texture, fractal, hsv, mixed

STALK: Color = (0.36, 0.28, 0.12)
_thickness = np.array(
    [0.30, 0.28, 0.32, 0.6, 0.86, 0.97, 1.0, 1.0, 1.0, 0.97, 0.9, 0.75, 0.5, 0.3, 0.24]
)


def make_banana(rng: Generator) -> Asset:
    """One to three bananas of 0.15 to 0.2 m, bent in the plane of the floor."""
    length, bend = rng.uniform(0.17, 0.21), rng.uniform(1.0, 1.7)
    radius = rng.uniform(0.017, 0.021)
    number = 1 if rng.random() < 0.65 else int(rng.integers(2, 4))
    skin = _skin(rng)
    parts: list[Part] = []
    shapes: list[CollisionShape] = []
    for index in range(number):
        lean = (index - (number - 1) / 2) * 0.30
        one = _one(length * rng.uniform(0.94, 1.0), bend, radius).at((0, 0, 0), (0, 0, lean))
        lift = -one.vertices[:, 2].min() + 0.010 * (index % 2)
        one = one.at((0, 0, lift))
        parts.append(Part(one, texture=skin, roughness=0.6))
        shapes += _boxes(one)
    return assemble("banana", *_centred(parts, shapes))


def _one(length: float, bend: float, radius: float) -> Surface:
    """Stalk end near the origin, the arc swelling towards +y."""
    turn = np.linspace(-bend / 2, bend / 2, len(_thickness))
    arc_radius = length / bend
    path = np.column_stack(
        [arc_radius * np.sin(turn), arc_radius * (1 - np.cos(turn)), np.zeros(len(turn))]
    )
    path -= path[0]
    return tube(path, radius * _thickness, 7, (0.0, 0.0, 1.0))


def _skin(rng: Generator) -> Texture:
    """Along the fruit from the blossom end (top row) to the stalk (bottom row)."""
    ripe = hsv(rng.uniform(0.125, 0.155), rng.uniform(0.75, 0.92), rng.uniform(0.82, 0.95))
    green = hsv(rng.uniform(0.17, 0.22), 0.75, 0.70)
    along = np.linspace(0, 1, 64)[:, None] * np.ones((1, 64))
    greenness = np.clip((np.abs(along - 0.5) - 0.40) * 8 * rng.uniform(0, 1), 0, 1)
    picture = mixed(greenness, ripe, green).astype(float)
    spots = np.clip((fractal(rng, 64, 0.9) - rng.uniform(1.2, 3.0)) * 3, 0, 1)
    brown = np.maximum(spots, ((along < 0.05) | (along > 0.93)).astype(float))[..., None]
    return (picture * (1 - brown) + brown * np.array(STALK) * 255).astype(np.uint8)


def _boxes(one: Surface) -> list[CollisionShape]:
    """Four boxes along x that together hold the fruit."""
    points = one.vertices
    edges = np.linspace(points[:, 0].min(), points[:, 0].max(), 5)
    return [_around(points, low, high) for low, high in itertools.pairwise(edges)]


def _around(points: Floats, low: float, high: float) -> CollisionShape:
    margin = (high - low) / 2
    chosen = points[(points[:, 0] >= low - margin) & (points[:, 0] <= high + margin)]
    (_, y0, _), (_, y1, top) = chosen.min(axis=0).tolist(), chosen.max(axis=0).tolist()
    return box_shape((low, y0, 0.0), (high, y1, top))


def _centred(
    parts: list[Part], shapes: list[CollisionShape]
) -> tuple[list[Part], list[CollisionShape]]:
    """Parts and shapes moved so that the origin is under their middle."""
    points = np.concatenate([part.surface.vertices for part in parts])
    x, y = ((points.min(axis=0) + points.max(axis=0)) / 2)[:2].tolist()
    moved = [Part(p.surface.at((-x, -y, 0)), p.color, p.texture, p.roughness) for p in parts]
    centers = [(s.center[0] - x, s.center[1] - y, s.center[2]) for s in shapes]
    placed = [CollisionShape(s.kind, c, s.half) for s, c in zip(shapes, centers, strict=True)]
    return moved, placed
