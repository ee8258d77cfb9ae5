"""Laboratories: benches under gantries of shelves, instruments, fume hoods, robots and bottles."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part
from sim.assets.furniture_parts import (
    BLACK,
    GREY,
    STEEL,
    WHITE,
    Point3,
    block,
    furniture,
    picture,
    post,
)  # fmt: skip
from sim.assets.surface import cylinder, lathe
from sim.assets.texture import Color, Texture, canvas, from_image, hsv, pick, shade


def make_lab_bench(rng: Generator) -> Asset:
    """A bench along y with a dark top, instruments and bottles, mostly with a gantry of shelves."""
    long, deep, top = rng.uniform(1.6, 3.0), rng.uniform(0.7, 0.9), 0.9
    under = pick(rng, [WHITE, (0.7, 0.72, 0.75), (0.35, 0.5, 0.65)], 0.03)
    surface = pick(rng, [(0.10, 0.10, 0.11), (0.18, 0.2, 0.22), (0.75, 0.76, 0.77)], 0.02)
    parts = [
        block((deep - 0.1, long - 0.05, top - 0.1), (-0.03, 0, top / 2), under, 0.6),
        block((deep, long, 0.04), (0, 0, top), surface, 0.4),
    ]
    for y in np.arange(-long / 2 + 0.4, long / 2, 0.5):
        parts.append(block((0.02, 0.01, top - 0.14), (deep / 2 - 0.08, float(y), top / 2), BLACK))
    if rng.random() < 0.75:
        parts += _gantry(rng, long, top)
    for y in np.arange(-long / 2 + 0.35, long / 2 - 0.2, 0.55):
        make = _instrument if rng.random() < 0.55 else _bottles
        parts += make(rng, (0.08, float(y), top + 0.02))
    return furniture("lab bench", parts)


def _gantry(rng: Generator, long: float, top: float) -> list[Part]:
    parts = [
        block((0.05, 0.05, 0.9), (-0.25, s * (long / 2 - 0.1), top + 0.45), GREY) for s in (-1, 1)
    ]
    for z in (top + 0.45, top + 0.8):
        parts.append(block((0.28, long - 0.1, 0.025), (-0.25, 0, z), (0.8, 0.8, 0.8)))
        for y in np.arange(-long / 2 + 0.2, long / 2 - 0.15, 0.3):
            if rng.random() < 0.7:
                parts += _bottles(rng, (-0.25, float(y), z + 0.012))
    return parts


def _bottles(rng: Generator, at: Point3) -> list[Part]:
    parts: list[Part] = []
    for _ in range(int(rng.integers(1, 4))):
        x, y, z = at[0] + rng.uniform(-0.06, 0.06), at[1] + rng.uniform(-0.1, 0.1), at[2]
        radius, high = rng.uniform(0.025, 0.05), rng.uniform(0.1, 0.24)
        profile = [(radius, 0), (radius, high * 0.65), (radius * 0.4, high * 0.85)]
        color = pick(rng, [(0.45, 0.25, 0.1), (0.75, 0.8, 0.8), hsv(rng.random(), 0.6, 0.7)], 0.03)
        cap = lathe([*profile, (radius * 0.4, high)], 10).at((x, y, z))
        parts.append(Part(cap, color, roughness=0.3))
    return parts


def _instrument(rng: Generator, at: Point3) -> list[Part]:
    """A box with a display and knobs."""
    x, y, z = at
    deep, wide, high = rng.uniform([0.25, 0.28, 0.16], [0.4, 0.48, 0.42]).tolist()
    color: Color = pick(rng, [(0.82, 0.83, 0.82), (0.5, 0.55, 0.6), (0.2, 0.22, 0.25)], 0.03)
    front = x + deep / 2
    parts = [
        block((deep, wide, high), (x, y, z + high / 2), color),
        picture((wide * 0.5, high * 0.5), (front, y - wide * 0.2, z + high * 0.6), _trace(rng)),
    ]
    for index in range(int(rng.integers(2, 5))):
        knob = cylinder(0.02, 0.03, 8).at(
            (front + 0.01, y + wide * 0.25, z + high * (0.2 + 0.17 * index)), (0, math.pi / 2, 0)
        )
        parts.append(Part(knob, BLACK))
    return parts


def _trace(rng: Generator) -> Texture:
    """An oscilloscope's screen."""
    image, draw = canvas((0.02, 0.06, 0.08), 48, 32)
    wave = 16 + 9 * np.sin(np.arange(48) * rng.uniform(0.1, 0.6)) * rng.uniform(0.3, 1.2)
    draw.line(list(zip(range(48), wave.tolist(), strict=True)), fill=(90, 255, 130), width=2)
    return from_image(image)


def make_fume_hood(rng: Generator) -> Asset:
    """A tall enclosure with a sash, front towards +x."""
    wide, high = rng.uniform(1.2, 1.8), rng.uniform(2.1, 2.4)
    color = pick(rng, [WHITE, (0.75, 0.78, 0.8)], 0.02)
    parts = [
        block((0.8, wide, 0.85), (0, 0, 0.425), color),
        block((0.8, wide, 0.05), (0, 0, 0.88), (0.3, 0.3, 0.32)),
        block((0.05, wide, high - 0.9), (-0.38, 0, (high + 0.9) / 2), shade(color, 0.8)),
        block((0.8, wide, 0.35), (0, 0, high - 0.175), color),
        block((0.02, wide - 0.1, 0.4), (0.37, 0, high - 0.55), (0.55, 0.68, 0.72), 0.2),
    ]
    parts += [
        block((0.8, 0.06, high - 0.9), (0, s * (wide / 2 - 0.03), (high + 0.9) / 2), color)
        for s in (-1, 1)
    ]
    return furniture("fume hood", parts + _bottles(rng, (0, 0.2, 0.9)))


def make_stool(rng: Generator) -> Asset:
    """A round lab stool."""
    high = rng.uniform(0.55, 0.72)
    color = pick(rng, [BLACK, (0.2, 0.3, 0.5), (0.55, 0.4, 0.25)], 0.03)
    parts = [post(0.17, (0, 0, high), 0.05, color), post(0.03, (0, 0, 0), high, STEEL)]
    return furniture("stool", [*parts, post(0.2, (0, 0, 0), 0.03, STEEL)])


def make_gas_bottle(rng: Generator) -> Asset:
    """A gas cylinder of 1.4 m."""
    color = pick(rng, [(0.1, 0.3, 0.15), (0.45, 0.1, 0.1), (0.15, 0.2, 0.45), GREY], 0.03)
    profile = [(0.115, 0), (0.115, 1.2), (0.08, 1.32), (0.03, 1.36), (0.03, 1.45)]
    return furniture("gas bottle", [Part(lathe(profile, 14), color, roughness=0.5)])


def make_rack(rng: Generator) -> Asset:
    """An open rack with machines, lights and cables, front towards +x."""
    wide, high = 0.62, rng.uniform(1.5, 2.1)
    parts = [
        block((0.6, 0.04, high), (0, s * wide / 2, high / 2), (0.12, 0.12, 0.13)) for s in (-1, 1)
    ]
    z = 0.1
    while z < high - 0.15:
        tall = rng.uniform(0.05, 0.2)
        color = pick(rng, [(0.1, 0.1, 0.11), (0.3, 0.31, 0.33), STEEL], 0.02)
        parts.append(block((0.55, wide - 0.06, tall - 0.01), (0, 0, z + tall / 2), color, 0.5))
        light = (0.0, 0.9, 0.3) if rng.random() < 0.7 else (1.0, 0.6, 0.1)
        parts.append(block((0.01, 0.02, 0.02), (0.28, rng.uniform(-0.2, 0.2), z + tall / 2), light))
        z += tall
    return furniture("rack", parts)
