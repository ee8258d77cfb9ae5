"""Traffic cones: a slim striped cone on a square rubber base."""

from __future__ import annotations

from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble, cylinder_shape
from sim.assets.surface import box, lathe
from sim.assets.texture import Color, bands, hsv, shade

WHITE: Color = (0.95, 0.95, 0.93)


def make_cone(rng: Generator) -> Asset:
    """A cone of 0.45 to 0.9 m, orange to red, with none to two reflecting bands."""
    height = rng.uniform(0.5, 0.95)
    radius = height * rng.uniform(0.19, 0.25)
    tip = rng.uniform(0.02, 0.035)
    color = hsv(rng.uniform(0.0, 0.07), rng.uniform(0.85, 0.97), rng.uniform(0.82, 0.98))
    profile = [(radius, 0.03), (tip, height - 0.01), (tip * 0.75, height)]
    body = Part(lathe(profile, 20), texture=bands(color, _stripes(rng)), roughness=0.6)
    base = Part(box(2.5 * radius, 2.5 * radius, 0.035).at((0, 0, 0.0175)), _base_color(rng, color))
    collar = Part(lathe([(radius * 1.12, 0.03), (radius * 1.02, 0.06)], 20), shade(color, 0.9))
    return assemble("cone", [body, base, collar], [cylinder_shape(radius * 1.15, 0.0, height)])


def _stripes(rng: Generator) -> list[tuple[float, float, Color]]:
    count = int(rng.choice([0, 1, 2], p=[0.1, 0.35, 0.55]))
    low = rng.uniform(0.36, 0.48)
    first = (low, low + rng.uniform(0.14, 0.22), WHITE)
    second = (low + 0.32, low + rng.uniform(0.40, 0.46), WHITE)
    return [first, second][:count]


def _base_color(rng: Generator, color: Color) -> Color:
    return (0.08, 0.08, 0.09) if rng.random() < 0.4 else shade(color, 0.85)
