"""Cordless power drills: motor housing, chuck, grip with trigger, battery."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble, box_shape
from sim.assets.shapes import rounded_box, tube
from sim.assets.surface import box, cylinder, lathe
from sim.assets.texture import Color, pick, shade

HOUSINGS: list[Color] = [
    (0.90, 0.68, 0.06),
    (0.05, 0.45, 0.48),
    (0.72, 0.07, 0.06),
    (0.06, 0.25, 0.55),
    (0.90, 0.38, 0.05),
    (0.10, 0.42, 0.16),
    (0.45, 0.75, 0.12),
]
RUBBER: Color = (0.07, 0.07, 0.08)
METAL: Color = (0.55, 0.56, 0.58)


@dataclass(frozen=True)
class _Shape:
    """Measures of the housing [m]: radius, length to the chuck, height of its axis."""

    radius: float
    length: float
    axis: float

    @property
    def rear(self) -> float:
        return -0.45 * self.length


def make_drill(rng: Generator) -> Asset:
    """A drill of 0.17 to 0.24 m, standing on its battery, chuck towards +x."""
    shape = _Shape(rng.uniform(0.028, 0.034), rng.uniform(0.12, 0.14), rng.uniform(0.15, 0.17))
    color = pick(rng, HOUSINGS, 0.03)
    parts = [*_housing(rng, shape, color), *_grip(rng, shape, color), *_battery(rng, color)]
    front = shape.rear + shape.length + 0.045
    top, r = shape.axis + shape.radius, shape.radius
    shapes = [
        box_shape((shape.rear, -r, shape.axis - r), (front, r, top)),
        box_shape((-0.045, -0.02, 0.045), (0.01, 0.02, shape.axis - r)),
        box_shape((-0.075, -0.037, 0.0), (0.045, 0.037, 0.05)),
    ]
    return assemble("drill", parts, shapes)


def _housing(rng: Generator, shape: _Shape, color: Color) -> list[Part]:
    r, long = shape.radius, shape.length
    lying = (0.0, math.pi / 2, 0.0)
    pieces: list[tuple[list[tuple[float, float]], Color]] = [
        ([(0.55 * r, 0), (0.9 * r, 0.004), (0.97 * r, 0.02), (0.97 * r, 0.03)], RUBBER),
        ([(r, 0.028), (1.03 * r, 0.05), (r, 0.72 * long), (0.92 * r, 0.76 * long)], color),
        ([(0.9 * r, 0.75 * long), (0.8 * r, 0.98 * long), (0.6 * r, long)], shade(color, 0.35)),
        ([(0.62 * r, long), (0.7 * r, long + 0.012), (0.68 * r, long + 0.026),
          (0.28 * r, long + 0.042)], RUBBER),
    ]  # fmt: skip
    at = (shape.rear, 0.0, shape.axis)
    parts = [Part(lathe(p, 16).at(at, lying), c, roughness=0.45) for p, c in pieces]
    plate = box(0.045, 2.02 * r, 0.022).at((shape.rear + 0.06, 0, shape.axis))
    parts.append(Part(plate, pick(rng, [RUBBER, (0.9, 0.9, 0.88), shade(color, 0.5)], 0.01)))
    if rng.random() < 0.5:
        reach = rng.uniform(0.03, 0.06)
        tip = (shape.rear + long + 0.04 + reach / 2, 0.0, shape.axis)
        parts.append(Part(cylinder(0.0035, reach, 6).at(tip, lying), METAL, roughness=0.4))
    return parts


def _grip(rng: Generator, shape: _Shape, color: Color) -> list[Part]:
    path = np.array([[0.0, 0, shape.axis - 0.012], [-0.012, 0, 0.105], [-0.022, 0, 0.045]])
    core = tube(path, [0.021, 0.0185, 0.021], 10)
    back = tube(np.add(path, [-0.008, 0, 0]), [0.018, 0.0155, 0.018], 8)
    trigger = box(0.016, 0.017, 0.032).at((0.018, 0, shape.axis - 0.05), (0, 0.25, 0))
    trigger_color = pick(rng, [(0.75, 0.08, 0.06), RUBBER, shade(color, 0.6)], 0.02)
    return [Part(core, color, roughness=0.6), Part(back, RUBBER), Part(trigger, trigger_color)]


def _battery(rng: Generator, color: Color) -> list[Part]:
    pack = RUBBER if rng.random() < 0.7 else shade(color, 0.85)
    foot = rounded_box(0.115, 0.072, 0.034, 0.015, 0.005).at((-0.015, 0, 0.017))
    shoe = rounded_box(0.10, 0.062, 0.02, 0.015, 0.004).at((-0.015, 0, 0.043))
    return [Part(foot, pack, roughness=0.6), Part(shoe, shade(color, 0.95), roughness=0.5)]
