"""Distractors: street furniture that is none of the classes a robot is asked about."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble, box_shape, cylinder_shape
from sim.assets.surface import Floats, Surface, ball, box, cylinder, lathe
from sim.assets.texture import Color, bands, fractal, hsv, mixed, mottled, pick, shade

METAL: Color = (0.45, 0.46, 0.48)


def make_bench(rng: Generator) -> Asset:
    """A park bench along y, seat towards +x."""
    wood = pick(rng, [(0.5, 0.32, 0.16), (0.35, 0.2, 0.1), (0.2, 0.35, 0.22)], 0.04)
    grain = mottled(rng, wood, 0.15)
    long = rng.uniform(1.3, 1.9)
    slats = [((-0.15 + 0.13 * i, 0, 0.45), (0, 0, 0)) for i in range(4)]
    slats += [
        ((-0.24 - 0.04 * i, 0, 0.60 + 0.14 * i), (0, math.pi / 2 - 0.25, 0)) for i in range(3)
    ]
    parts = [Part(box(0.1, long, 0.03).at(at, rpy), texture=grain) for at, rpy in slats]
    for y in (-long / 2 + 0.15, long / 2 - 0.15):
        for x, high in ((-0.22, 0.85), (0.22, 0.44)):
            parts.append(Part(box(0.05, 0.05, high).at((x, y, high / 2)), (0.1, 0.1, 0.11)))
    return assemble("bench", parts, [box_shape((-0.35, -long / 2, 0), (0.3, long / 2, 0.85))])


def make_post(rng: Generator) -> Asset:
    """A bollard or a marker post of 0.7 to 1.2 m."""
    height, radius = rng.uniform(0.7, 1.2), rng.uniform(0.04, 0.09)
    color = pick(
        rng, [(0.1, 0.1, 0.1), METAL, (0.9, 0.9, 0.88), (0.3, 0.2, 0.12), (0.1, 0.3, 0.15)]
    )
    stripe = pick(rng, [(0.9, 0.9, 0.88), (0.8, 0.1, 0.1), color], 0.02)
    profile = [(radius, 0), (radius, height - 0.05), (radius * 0.7, height)]
    pole = Part(lathe(profile, 12), texture=bands(color, [(0.7, 0.85, stripe)]), roughness=0.6)
    foot = Part(cylinder(radius * 1.6, 0.04).at((0, 0, 0.02)), shade(color, 0.7))
    return assemble("post", [pole, foot], [cylinder_shape(radius * 1.6, 0, height)])


def make_crate(rng: Generator) -> Asset:
    """A wooden crate or a cardboard box."""
    x, y, z = rng.uniform(0.35, 0.8, 3)
    wood = pick(rng, [(0.60, 0.43, 0.25), (0.50, 0.35, 0.2), (0.66, 0.50, 0.33)], 0.03)
    lines = np.tile(np.arange(64)[:, None] % 16 == 0, (1, 64)) * (rng.random() < 0.7)
    sides = mixed(0.75 + 0.12 * fractal(rng, 64, 0.8) - 0.6 * lines, shade(wood, 0.4), wood)
    parts = [Part(box(x, y, z).at((0, 0, z / 2)), texture=sides)]
    for a in (-1, 1):
        for b in (-1, 1):
            edge = box(0.06, 0.06, z + 0.01).at((a * x / 2, b * y / 2, z / 2))
            parts.append(Part(edge, shade(wood, 0.75)))
    return assemble("crate", parts, [box_shape((-x / 2, -y / 2, 0), (x / 2, y / 2, z))])


def make_rock(rng: Generator) -> Asset:
    """A boulder of 0.3 to 0.7 m."""
    size = rng.uniform(0.2, 0.45)
    sphere = ball(1.0, 2)
    waves = sum(np.sin(sphere.vertices @ rng.normal(0, f, 3)) for f in (1.5, 3, 6))
    swell = 1 + 0.12 * np.asarray(waves) + 0.03 * rng.normal(size=len(sphere.vertices))
    stretch = size * rng.uniform([0.8, 0.8, 0.5], [1.3, 1.3, 0.9])
    vertices = sphere.vertices * swell[:, None] * stretch + [0, 0, stretch[2] * 0.6]
    stone = mottled(rng, pick(rng, [(0.45, 0.44, 0.42), (0.5, 0.45, 0.38)], 0.04), 0.2)
    part = Part(
        Surface(grounded(vertices), sphere.triangles, sphere.uvs).tiled(2, 1), texture=stone
    )
    reach = float(max(stretch[:2]))
    return assemble("rock", [part], [cylinder_shape(reach, 0, float(stretch[2]) * 1.5)])


def make_bin(rng: Generator) -> Asset:
    """A litter bin on a foot or a wheeled container."""
    color = pick(rng, [(0.1, 0.3, 0.15), (0.2, 0.2, 0.22), (0.3, 0.3, 0.32), (0.1, 0.2, 0.4)], 0.04)
    wide, height = rng.uniform(0.45, 0.6), rng.uniform(0.85, 1.1)
    body = box(1, 1, 1)
    taper = (
        body.vertices * [wide, wide, height] * np.where(body.vertices[:, 2:] > 0, 1, [0.8, 0.8, 1])
    )
    tub = Surface(taper, body.triangles, body.uvs).at((0, 0, height / 2 + 0.05))
    lid = box(wide * 1.08, wide * 1.06, 0.07).at(
        (0, 0, height + 0.08), (0, rng.uniform(-0.1, 0.1), 0)
    )
    wheels = [
        cylinder(0.09, 0.06).at((-wide / 2, s * wide * 0.38, 0.09), (math.pi / 2, 0, 0))
        for s in (-1, 1)
    ]
    parts = [Part(tub, color, roughness=0.6), Part(lid, shade(color, 0.8), roughness=0.6)]
    parts += [Part(wheel, (0.05, 0.05, 0.05)) for wheel in wheels]
    return assemble(
        "bin", parts, [box_shape((-wide / 2, -wide / 2, 0), (wide / 2, wide / 2, height))]
    )


def make_sign(rng: Generator) -> Asset:
    """A round or square traffic sign on a pole."""
    height, radius = rng.uniform(1.6, 2.3), rng.uniform(0.25, 0.35)
    face = hsv(rng.choice([0.0, 0.6, 0.33, 0.14]), 0.85, rng.uniform(0.5, 0.8))
    plate = cylinder(radius, 0.02, int(rng.choice([4, 8, 20])))
    inner = cylinder(radius * 0.75, 0.026, 20)
    lying = (0.0, math.pi / 2, 0.0)
    parts = [
        Part(cylinder(0.03, height, 8).at((0, 0, height / 2)), METAL),
        Part(plate.at((0.04, 0, height), lying), face, roughness=0.6),
        Part(inner.at((0.04, 0, height), lying), (0.92, 0.92, 0.92), roughness=0.6),
    ]
    return assemble("sign", parts, [cylinder_shape(0.05, 0, height)])


def make_bush(rng: Generator) -> Asset:
    """A low shrub without a trunk."""
    size = rng.uniform(0.3, 0.6)
    color = hsv(rng.uniform(0.22, 0.36), 0.6, rng.uniform(0.3, 0.5))
    leaves = mixed(0.5 + 0.3 * fractal(rng, 64, 0.4), shade(color, 0.4), shade(color, 1.25))
    parts: list[Part] = []
    for _ in range(3):
        sphere = ball(size * rng.uniform(0.7, 1), 2)
        swell = 1 + 0.06 * rng.normal(size=(len(sphere.vertices), 1))
        at = np.array([*rng.uniform(-0.4, 0.4, 2) * size, size * 0.6])
        parts.append(
            Part(
                Surface(grounded(sphere.vertices * swell + at), sphere.triangles, sphere.uvs * 2),
                texture=leaves,
            )
        )
    return assemble("bush", parts, [cylinder_shape(size, 0, size * 1.3)])


def grounded(vertices: Floats) -> Floats:
    """Vertices (n, 3) with whatever lies under the ground pressed up to just below it."""
    return np.maximum(vertices, [-np.inf, -np.inf, -0.02])
