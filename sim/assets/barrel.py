"""Barrels: ribbed steel drums, smooth plastic drums and wooden casks."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble, cylinder_shape
from sim.assets.surface import cylinder, lathe
from sim.assets.texture import Color, Texture, fractal, mixed, mottled, pick, shade

STEEL: list[Color] = [
    (0.07, 0.22, 0.55),
    (0.08, 0.35, 0.18),
    (0.10, 0.10, 0.11),
    (0.55, 0.09, 0.08),
    (0.45, 0.47, 0.49),
    (0.10, 0.30, 0.60),
    (0.85, 0.65, 0.10),
]
RUST: Color = (0.36, 0.17, 0.08)


def make_barrel(rng: Generator) -> Asset:
    """A barrel of 0.75 to 1.0 m."""
    height, radius = rng.uniform(0.78, 0.98), rng.uniform(0.27, 0.33)
    parts = _cask(rng, radius, height) if rng.random() < 0.22 else _drum(rng, radius, height)
    return assemble("barrel", parts, [cylinder_shape(radius * 1.05, 0.0, height)])


def _drum(rng: Generator, radius: float, height: float) -> list[Part]:
    color = pick(rng, STEEL, 0.04)
    profile = [(radius * 0.99, 0.0), (radius * 1.03, 0.015), (radius, 0.035)]
    for rib in (height * 0.34, height * 0.66):
        profile += [(radius, rib - 0.03), (radius * 1.05, rib), (radius, rib + 0.03)]
    rim = [(radius, height - 0.04), (radius * 1.03, height - 0.015), (radius, height)]
    lid = [(radius * 0.93, height - 0.03), (0.0, height - 0.03)]
    body = Part(lathe(profile + rim, 24), texture=_painted(rng, color), roughness=0.4)
    top = Part(lathe([(radius, height), *lid], 24), shade(color, 0.85), roughness=0.5)
    bung = Part(cylinder(0.04, 0.03, 8).at((radius * 0.55, 0, height - 0.02)), (0.6, 0.6, 0.6))
    return [body, top, bung]


def _painted(rng: Generator, color: Color) -> Texture:
    """Paint with more or less rust showing through."""
    if rng.random() < 0.5:
        return mottled(rng, color, 0.06)
    rust = np.clip((fractal(rng, 64, 1.2) - rng.uniform(1.0, 2.2)) * 3, 0, 1)
    return mixed(rust, color, RUST)


def _cask(rng: Generator, radius: float, height: float) -> list[Part]:
    wood = pick(rng, [(0.45, 0.27, 0.13), (0.36, 0.20, 0.10), (0.55, 0.36, 0.20)], 0.03)
    levels = np.linspace(0, 1, 9)
    bulge = 0.82 + 0.18 * np.sin(levels * math.pi)
    profile = np.stack([radius * bulge, levels * height], axis=1)
    staves = Part(lathe(profile, 20), texture=_staves(rng, wood))
    hoops = [_hoop(radius, height, level) for level in (0.06, 0.25, 0.75, 0.94)]
    lid = lathe([(radius * 0.78, height), (0.0, height + 0.002)], 20)
    return [staves, *hoops, Part(lid, shade(wood, 0.8))]


def _staves(rng: Generator, wood: Color) -> Texture:
    joints = np.tile(np.arange(128) % 8 == 0, (128, 1))
    return mixed(0.25 * fractal(rng, 128, 0.8) + 0.8 - joints, shade(wood, 0.35), shade(wood, 1.1))


def _hoop(radius: float, height: float, level: float) -> Part:
    low, high = max(level - 0.025, 0.0), min(level + 0.025, 1.0)
    ends = [(radius * (0.835 + 0.18 * math.sin(v * math.pi)), v * height) for v in (low, high)]
    return Part(lathe(ends, 20), (0.25, 0.25, 0.27), roughness=0.5)
