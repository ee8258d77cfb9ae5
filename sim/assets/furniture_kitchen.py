"""Kitchens: runs of cabinets with sink and stove, refrigerators, cupboards and what lies about."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part
from sim.assets.furniture_parts import (
    BLACK,
    STEEL,
    WHITE,
    block,
    furniture,
    post,
    speckled,
    wood_or_paint,
)  # fmt: skip
from sim.assets.surface import box, cylinder, lathe
from sim.assets.texture import Color, hsv, pick, shade

DEPTH = 0.6
UNIT = 0.6
"""Width of one cabinet [m]."""


def make_counter(rng: Generator) -> Asset:
    """A run of two to five cabinets along y with a sink, mostly a stove, and cupboards above."""
    units, front, top = int(rng.integers(2, 6)), wood_or_paint(rng), rng.uniform(0.86, 0.94)
    long = units * UNIT
    parts = [block((DEPTH - 0.06, long, top - 0.1), (-0.03, 0, top / 2 + 0.03), shade(front, 0.8))]
    slab = box(DEPTH, long, 0.04).at((0, 0, top))
    stone = pick(rng, [(0.25, 0.25, 0.27), (0.75, 0.73, 0.70), (0.5, 0.4, 0.3)], 0.04)
    parts.append(Part(slab, texture=speckled(rng, stone), roughness=0.4))
    spots = [(i + 0.5) * UNIT - long / 2 for i in range(units)]
    order = rng.permutation(units)
    for y in spots:
        parts += _front(rng, y, top, front)
    parts += _sink(spots[order[0]], top)
    if units > 2 and rng.random() < 0.85:
        parts += _stove(rng, spots[order[1]], top)
    parts += _clutter(rng, spots[order[-1]], top)
    if rng.random() < 0.75:
        parts += _cupboards(rng, spots, front)
    return furniture("counter", parts)


def _front(rng: Generator, y: float, top: float, color: Color) -> list[Part]:
    drawers = rng.random() < 0.3
    heights = [(0.12, 0.35), (0.36, 0.59), (0.60, top - 0.05)] if drawers else [(0.12, top - 0.05)]
    parts: list[Part] = []
    for low, high in heights:
        size = (0.02, UNIT - 0.015, high - low - 0.01)
        parts.append(block(size, (DEPTH / 2 - 0.05, y, (low + high) / 2), color, 0.6))
        handle = (0.02, 0.16, 0.015)
        parts.append(block(handle, (DEPTH / 2 - 0.03, y, high - 0.05), STEEL, 0.3))
    return parts


def _sink(y: float, top: float) -> list[Part]:
    basin = block((0.38, 0.46, 0.01), (0.02, y, top + 0.018), STEEL, 0.3)
    bowl = block((0.32, 0.38, 0.01), (0.02, y, top + 0.022), shade(STEEL, 0.5), 0.3)
    neck = post(0.014, (-0.2, y, top), 0.28, STEEL, 0.2)
    spout = Part(
        cylinder(0.012, 0.2, 8).at((-0.11, y, top + 0.28), (0, math.pi / 2, 0)),
        STEEL, roughness=0.2,
    )  # fmt: skip
    return [basin, bowl, neck, spout]


def _stove(rng: Generator, y: float, top: float) -> list[Part]:
    body: Color = BLACK if rng.random() < 0.5 else STEEL
    parts = [
        block((0.52, 0.56, 0.01), (0, y, top + 0.025), BLACK, 0.2),
        block((0.03, 0.58, 0.42), (DEPTH / 2 - 0.045, y, 0.48), body, 0.3),
        block((0.035, 0.44, 0.24), (DEPTH / 2 - 0.045, y, 0.46), (0.10, 0.10, 0.12), 0.2),
        block((0.04, 0.5, 0.02), (DEPTH / 2 - 0.02, y, 0.66), STEEL, 0.3),
    ]
    for a in (-0.12, 0.12):
        for b in (-0.13, 0.13):
            ring = cylinder(0.09, 0.012, 14).at((a, y + b, top + 0.034))
            parts.append(Part(ring, (0.22, 0.22, 0.23)))
    if rng.random() < 0.6:
        pot = lathe([(0.10, 0), (0.11, 0.14), (0.10, 0.15)], 14).at((-0.12, y - 0.13, top + 0.04))
        parts.append(
            Part(pot, pick(rng, [STEEL, (0.6, 0.1, 0.1), (0.1, 0.15, 0.2)]), roughness=0.3)
        )
    if rng.random() < 0.7:
        hood = lathe([(0.36, 1.55), (0.14, 1.8), (0.13, 2.25)], 4)
        parts.append(Part(hood.at((-0.05, y, 0), (0, 0, math.pi / 4)), STEEL, roughness=0.3))
    return parts


def _clutter(rng: Generator, y: float, top: float) -> list[Part]:
    """A microwave oven, a kettle, jars."""
    parts: list[Part] = []
    if rng.random() < 0.5:
        parts += [
            block((0.34, 0.48, 0.28), (-0.1, y, top + 0.16), pick(rng, [WHITE, BLACK, STEEL]), 0.5),
            block((0.01, 0.32, 0.20), (0.075, y - 0.05, top + 0.16), (0.08, 0.08, 0.1), 0.2),
        ]
    for _ in range(int(rng.integers(1, 5))):
        color = hsv(rng.random(), rng.uniform(0.1, 0.8), rng.uniform(0.3, 0.9))
        x, z = rng.uniform(-0.2, 0.15), rng.uniform(0.08, 0.26)
        parts.append(post(rng.uniform(0.03, 0.07), (x, y + rng.uniform(-0.6, 0.6), top), z, color))
    return parts


def _cupboards(rng: Generator, spots: list[float], color: Color) -> list[Part]:
    low, high = 1.42, rng.uniform(1.95, 2.15)
    parts: list[Part] = []
    for y in spots:
        if rng.random() < 0.8:
            middle = (low + high) / 2
            size = (0.32, UNIT - 0.015, high - low)
            parts.append(block(size, (-DEPTH / 2 + 0.17, y, middle), color, 0.6))
            edge = (0.012, 0.012, high - low)
            parts.append(block(edge, (-DEPTH / 2 + 0.332, y, middle), shade(color, 0.55)))
            handle = (0.02, 0.015, 0.14)
            parts.append(block(handle, (-DEPTH / 2 + 0.34, y + 0.24, low + 0.12), STEEL, 0.3))
    return parts


def make_fridge(rng: Generator) -> Asset:
    """A refrigerator of 1.5 to 2 m with its door towards +x."""
    high, wide = rng.uniform(1.5, 2.0), rng.uniform(0.58, 0.85)
    color = pick(rng, [WHITE, STEEL, (0.12, 0.12, 0.13), (0.7, 0.2, 0.15)], 0.03)
    split = high * rng.uniform(0.6, 0.72)
    parts = [block((0.62, wide, high), (-0.02, 0, high / 2), shade(color, 0.85), 0.5)]
    for low, top in ((0.06, split), (split + 0.015, high)):
        size = (0.05, wide - 0.01, top - low)
        parts.append(block(size, (0.31, 0, (low + top) / 2), color, 0.4))
        handle = (0.04, 0.025, min(0.45, 0.7 * (top - low)))
        parts.append(block(handle, (0.36, wide * 0.4, (low + top) / 2), shade(STEEL, 0.8), 0.3))
    return furniture("fridge", parts)


def make_kitchen_table(rng: Generator) -> Asset:
    """A small table with stools and a fruit bowl."""
    side, top = rng.uniform(0.7, 1.0), 0.75
    color = wood_or_paint(rng)
    parts = [block((side, side, 0.04), (0, 0, top), color, 0.6)]
    parts.append(post(0.05, (0, 0, 0), top, shade(color, 0.6)))
    bowl = lathe([(0.05, 0), (0.14, 0.08), (0.15, 0.09)], 14).at((0.1, 0, top + 0.02))
    parts.append(Part(bowl, hsv(rng.random(), 0.5, 0.7), roughness=0.4))
    for angle in np.arange(int(rng.integers(2, 5))) * math.pi / 2 + rng.uniform(0, 1):
        x, y = (side / 2 + 0.2) * math.cos(angle), (side / 2 + 0.2) * math.sin(angle)
        parts.append(post(0.17, (x, y, 0.43), 0.04, color))
        parts.append(post(0.025, (x, y, 0), 0.43, STEEL))
    return furniture("kitchen table", parts)
