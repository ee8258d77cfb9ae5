"""Pitchers: a tapered or bellied jug with a handle, a spout and often a lid."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble, box_shape, cylinder_shape
from sim.assets.shapes import arc, tube
from sim.assets.surface import Floats, Surface, cylinder, lathe
from sim.assets.texture import Color, bands, pick, shade

PLASTIC: list[Color] = [
    (0.07, 0.22, 0.62),
    (0.05, 0.35, 0.65),
    (0.70, 0.10, 0.10),
    (0.10, 0.45, 0.30),
    (0.85, 0.85, 0.83),
    (0.55, 0.75, 0.80),
    (0.80, 0.55, 0.15),
]
WHITE: Color = (0.93, 0.93, 0.91)


def make_pitcher(rng: Generator) -> Asset:
    """A pitcher of 0.2 to 0.27 m, spout towards +x, handle towards -x."""
    height, radius = rng.uniform(0.21, 0.26), rng.uniform(0.052, 0.064)
    color = pick(rng, PLASTIC, 0.03)
    wide = _tapered(rng) if rng.random() < 0.65 else _bellied(rng)
    outside = np.stack([radius * wide, np.linspace(0, height, len(wide))], axis=1)
    parts = [_body(rng, outside, color), _handle(rng, outside, height, color)]
    rim = float(outside[-1, 0])
    lidded = rng.random() < 0.6
    parts += _lid(rng, rim, height, color) if lidded else _mouth(rim, height, color)
    parts.append(Part(_spout(rim, height), color, roughness=0.35))
    low, high = (-float(outside[:, 0].max()) - 0.05, -0.014, height * 0.3), (-rim, 0.014, height)
    body = cylinder_shape(float(outside[:, 0].max()), 0.0, height)
    return assemble("pitcher", parts, [body, box_shape(low, high)])


def _tapered(rng: Generator) -> Floats:
    return np.linspace(rng.uniform(0.82, 0.95), rng.uniform(1.05, 1.2), 6)


def _bellied(rng: Generator) -> Floats:
    level = np.linspace(0, 1, 12)
    belly = rng.uniform(0.25, 0.4) * np.sin(level**0.8 * math.pi) ** 1.5
    return 0.85 + belly - 0.12 * (level > 0.7) * (level - 0.7) / 0.3


def _body(rng: Generator, outside: Floats, color: Color) -> Part:
    foot = np.array([[0.0, 0.001], [outside[0, 0] * 0.96, 0.0]])
    surface = lathe(np.concatenate([foot, outside]), 22)
    if rng.random() < 0.25:
        low = rng.uniform(0.3, 0.6)
        return Part(surface, texture=bands(color, [(low, low + 0.12, WHITE)]), roughness=0.35)
    return Part(surface, color, roughness=0.35)


def _handle(rng: Generator, outside: Floats, height: float, color: Color) -> Part:
    top, low = height * rng.uniform(0.86, 0.93), height * rng.uniform(0.25, 0.4)
    half = (top - low) / 2
    bow = arc(half, math.pi / 2, 3 * math.pi / 2, 9) * [rng.uniform(0.75, 1.0), 1, 1]
    radius = float(np.interp((top + low) / 2, outside[:, 1], outside[:, 0]))
    surface = tube(np.add(bow, [-radius * 0.95, 0, (top + low) / 2]), 0.0095, 8)
    return Part(surface, shade(color, rng.uniform(0.85, 1.0)), roughness=0.35)


def _lid(rng: Generator, rim: float, height: float, color: Color) -> list[Part]:
    paint = WHITE if rng.random() < 0.6 else shade(color, rng.uniform(0.5, 0.8))
    top = lathe([(rim * 1.04, height - 0.004), (rim * 1.05, height + 0.006),
                 (rim * 0.6, height + 0.016), (0.0, height + 0.018)], 22)  # fmt: skip
    knob = cylinder(0.014, 0.012, 10).at((0, 0, height + 0.022))
    return [Part(top, paint, roughness=0.4), Part(knob, paint, roughness=0.4)]


def _mouth(rim: float, height: float, color: Color) -> list[Part]:
    """The open top: the inside, seen a little way down."""
    inside = lathe([(rim, height), (rim * 0.93, height - 0.002), (rim * 0.86, height - 0.06),
                    (0.0, height - 0.06)], 22)  # fmt: skip
    return [Part(inside, shade(color, 0.45))]


def _spout(rim: float, height: float) -> Surface:
    return tube([(rim * 0.55, 0, height - 0.045), (rim * 1.0, 0, height - 0.014),
                 (rim * 1.30, 0, height + 0.002)], [0.028, 0.024, 0.010], 8)  # fmt: skip
