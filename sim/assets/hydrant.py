"""Fire hydrants: barrel, flanges, domed bonnet, operating nut, two hose caps and a pumper cap."""

from __future__ import annotations

import math

from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble, cylinder_shape
from sim.assets.surface import cylinder, lathe
from sim.assets.texture import Color, mottled, pick, shade

PAINTS: list[Color] = [(0.75, 0.08, 0.07), (0.78, 0.10, 0.08), (0.70, 0.05, 0.05),
                       (0.90, 0.72, 0.08), (0.85, 0.80, 0.75), (0.12, 0.30, 0.65)]  # fmt: skip
CAPS: list[Color] = [(0.80, 0.76, 0.25), (0.85, 0.85, 0.85), (0.15, 0.15, 0.16), (0.1, 0.4, 0.2)]


def make_hydrant(rng: Generator) -> Asset:
    """A hydrant of 0.62 to 0.85 m; the pumper cap looks along +x."""
    scale = rng.uniform(0.92, 1.22)
    paint = pick(rng, PAINTS, 0.03)
    cap = paint if rng.random() < 0.35 else pick(rng, CAPS, 0.03)
    bonnet = paint if rng.random() < 0.7 else cap
    neck = rng.uniform(0.40, 0.48)
    parts = [
        Part(lathe(_barrel_profile(neck), 20), texture=mottled(rng, paint, 0.05), roughness=0.4),
        Part(lathe(_bonnet_profile(neck), 20), bonnet, roughness=0.4),
        Part(cylinder(0.032, 0.06, 5).at((0, 0, neck + 0.265)), cap, roughness=0.5),
        *_outlet(0.085, 0.20, 0.0, neck - 0.12, cap),
        *_outlet(0.06, 0.19, math.pi / 2, neck - 0.09, cap),
        *_outlet(0.06, 0.19, -math.pi / 2, neck - 0.09, cap),
        *_bolts(0.048, cap if rng.random() < 0.5 else shade(paint, 0.6)),
        *_bolts(neck + 0.035, shade(paint, 0.6)),
    ]
    scaled = [Part(p.surface.scaled([scale] * 3), p.color, p.texture, p.roughness) for p in parts]
    return assemble("hydrant", scaled, [cylinder_shape(0.19 * scale, 0.0, 0.7 * scale)])


def _barrel_profile(neck: float) -> list[tuple[float, float]]:
    return [(0.17, 0), (0.17, 0.035), (0.13, 0.045), (0.118, 0.07), (0.115, neck - 0.03),
            (0.155, neck - 0.02), (0.155, neck + 0.02)]  # fmt: skip


def _bonnet_profile(neck: float) -> list[tuple[float, float]]:
    dome = [(0.135 * math.cos(a), neck + 0.05 + 0.17 * math.sin(a))
            for a in (0.0, 0.3, 0.6, 0.9, 1.15, 1.35)]  # fmt: skip
    return [(0.15, neck + 0.02), (0.15, neck + 0.04), *dome, (0.0, neck + 0.225)]


def _outlet(radius: float, reach: float, yaw: float, height: float, color: Color) -> list[Part]:
    """A short neck with a wider cap and a nut, pointing along `yaw` [rad]."""
    parts: list[Part] = []
    for size, length, middle, sides in (
        (radius * 0.8, reach - 0.02, (reach - 0.02) / 2, 12),
        (radius, 0.06, reach - 0.02, 12),
        (radius * 0.35, 0.035, reach + 0.025, 5),
    ):
        lying = cylinder(size, length, sides).at(rpy=(0, math.pi / 2, yaw))
        at = (middle * math.cos(yaw), middle * math.sin(yaw), height)
        parts.append(Part(lying.at(at), color, roughness=0.45))
    return parts


def _bolts(height: float, color: Color) -> list[Part]:
    angles = [index * math.pi / 4 + 0.2 for index in range(8)]
    return [
        Part(cylinder(0.013, 0.03, 5).at((0.147 * math.cos(a), 0.147 * math.sin(a), height)), color)
        for a in angles
    ]
