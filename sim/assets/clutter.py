"""Small things that lie about and are none of the classes, some of them not unlike one."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble, box_shape, cylinder_shape
from sim.assets.shapes import arc, rounded_box, tube
from sim.assets.surface import Surface, ball, box, cylinder, lathe, loft, slab
from sim.assets.texture import Color, bands, hsv, mottled, pick, shade

PAPER: Color = (0.93, 0.92, 0.88)
STEEL: Color = (0.60, 0.61, 0.63)


def make_carton(rng: Generator) -> Asset:
    """A closed cardboard parcel with tape across the top."""
    x, y, z = rng.uniform([0.15, 0.15, 0.10], [0.42, 0.40, 0.32])
    brown = pick(rng, [(0.66, 0.50, 0.32), (0.58, 0.42, 0.26), (0.85, 0.83, 0.78)], 0.03)
    tape = pick(rng, [(0.78, 0.66, 0.45), (0.50, 0.34, 0.18), (0.85, 0.82, 0.72)], 0.02)
    body = Part(box(x, y, z).at((0, 0, z / 2)), texture=mottled(rng, brown, 0.05))
    strip = Part(box(x + 0.002, 0.05, z + 0.002).at((0, 0, z / 2)), tape, roughness=0.5)
    label = Part(box(0.09, 0.002, 0.06).at((x * 0.15, y / 2, z * 0.6)), PAPER)
    shape = box_shape((-x / 2, -y / 2, 0), (x / 2, y / 2, z))
    return assemble("carton", [body, strip, label], [shape])


def make_mug(rng: Generator) -> Asset:
    """A coffee mug of 0.08 to 0.11 m."""
    radius, height = rng.uniform(0.036, 0.046), rng.uniform(0.08, 0.11)
    color = hsv(rng.random(), rng.uniform(0.0, 0.8), rng.uniform(0.3, 0.95))
    stripe = [(0.35, 0.6, PAPER)] if rng.random() < 0.4 else []
    outside = lathe([(0, 0), (radius * 0.92, 0), (radius, 0.01), (radius, height)], 16)
    inside = lathe([(radius, height), (radius * 0.9, height - 0.001),
                    (radius * 0.88, height - 0.03), (0, height - 0.03)], 16)  # fmt: skip
    loop = tube(np.add(arc(0.025, -1.4, 1.4, 7, 1.1), [radius, 0, height * 0.5]), 0.006, 6)
    parts = [
        Part(outside, texture=bands(color, stripe), roughness=0.4),
        Part(inside, pick(rng, [(0.15, 0.08, 0.04), shade(color, 0.5)], 0.01)),
        Part(loop, color, roughness=0.4),
    ]
    return assemble("mug", parts, [cylinder_shape(radius, 0, height)])


def make_bucket(rng: Generator) -> Asset:
    """A pail of 0.22 to 0.32 m, wider above, with a wire handle laid to one side."""
    radius, height = rng.uniform(0.13, 0.17), rng.uniform(0.22, 0.32)
    color = pick(rng, [STEEL, (0.1, 0.1, 0.12), (0.75, 0.1, 0.1), (0.1, 0.3, 0.6), PAPER], 0.04)
    outside = lathe([(0, 0), (radius * 0.75, 0), (radius, height), (radius * 1.04, height)], 20)
    inside = lathe([(radius, height), (radius * 0.95, height - 0.002),
                    (radius * 0.72, 0.02), (0, 0.02)], 20)  # fmt: skip
    bow = arc(radius, 0, math.pi, 12, 0.8)[:, [1, 0, 2]]
    lean = rng.uniform(1.2, 1.5) * rng.choice([-1, 1])
    handle = tube(bow, 0.004, 5, (1, 0, 0)).at((0, 0, height - 0.02), (0, lean, 0))
    parts = [Part(outside, color, roughness=0.5), Part(inside, shade(color, 0.55))]
    parts.append(Part(handle, STEEL, roughness=0.4))
    return assemble("bucket", parts, [cylinder_shape(radius, 0, height)])


def make_book(rng: Generator) -> Asset:
    """A book, or a pile of up to three, lying flat."""
    parts: list[Part] = []
    level = 0.0
    for _ in range(int(rng.choice([1, 1, 2, 3]))):
        x, y, z = rng.uniform([0.13, 0.19, 0.015], [0.20, 0.27, 0.045])
        color = hsv(rng.random(), rng.uniform(0.1, 0.8), rng.uniform(0.15, 0.75))
        turn = (0.0, 0.0, rng.uniform(-0.4, 0.4))
        cover = box(x, y, z).at((0, 0, level + z / 2), turn)
        pages = box(x * 0.97, y * 0.98, z * 0.7).at((x * 0.025, 0, level + z / 2), turn)
        title = box(x * 0.5, y * 0.2, 0.002).at((0, 0, level + z), turn)
        parts += [Part(cover, color), Part(pages, PAPER), Part(title, shade(color, 1.8))]
        level += z
    return assemble("book", parts, [box_shape((-0.10, -0.13, 0), (0.10, 0.13, level))])


def make_can(rng: Generator) -> Asset:
    """A drink or food can of 0.08 to 0.13 m."""
    radius, height = rng.uniform(0.031, 0.042), rng.uniform(0.08, 0.125)
    color = hsv(rng.random(), rng.uniform(0.3, 0.9), rng.uniform(0.3, 0.85))
    low = rng.uniform(0.2, 0.5)
    print_ = [(low, low + 0.25, PAPER), (0.0, 0.05, STEEL), (0.95, 1.0, STEEL)]
    side = lathe([(radius * 0.92, 0), (radius, 0.006), (radius, height - 0.006),
                  (radius * 0.9, height)], 16)  # fmt: skip
    lid = lathe([(radius * 0.9, height - 0.001), (0, height - 0.004)], 16)
    parts = [Part(side, texture=bands(color, print_), roughness=0.35), Part(lid, STEEL)]
    return assemble("can", parts, [cylinder_shape(radius, 0, height)])


def make_bottle(rng: Generator) -> Asset:
    """A slender drink bottle of 0.2 to 0.32 m, never yellow."""
    radius, height = rng.uniform(0.030, 0.040), rng.uniform(0.20, 0.32)
    glass = pick(rng, [(0.08, 0.28, 0.12), (0.28, 0.14, 0.05), (0.55, 0.70, 0.78),
                       (0.10, 0.20, 0.45), (0.75, 0.75, 0.75)], 0.03)  # fmt: skip
    label = pick(rng, [PAPER, (0.7, 0.1, 0.1), (0.1, 0.3, 0.6)], 0.03)
    profile = [(0, 0), (radius * 0.95, 0), (radius, 0.01), (radius, height * 0.58),
               (radius * 0.8, height * 0.68), (radius * 0.36, height * 0.8),
               (radius * 0.34, height)]  # fmt: skip
    body = Part(lathe(profile, 16), texture=bands(glass, [(0.3, 0.52, label)]), roughness=0.3)
    cap = Part(cylinder(radius * 0.42, 0.02, 10).at((0, 0, height)), shade(label, 0.8))
    return assemble("bottle", [body, cap], [cylinder_shape(radius, 0, height)])


def make_shoe(rng: Generator) -> Asset:
    """A shoe of 0.25 to 0.3 m, toe towards +x."""
    long, color = rng.uniform(0.25, 0.30), hsv(rng.random(), rng.uniform(0, 0.8), rng.random())
    stations = [(-0.5, 0.055, 0.085), (-0.3, 0.075, 0.10), (0.0, 0.08, 0.085), (0.3, 0.09, 0.055),
                (0.46, 0.075, 0.042), (0.5, 0.04, 0.03)]  # fmt: skip
    rings = [[(x * long, y * w / 2, z) for y, z in _instep(high)] for x, w, high in stations]
    upper = loft(np.array(rings))
    sole = rounded_box(long, 0.085, 0.022, 0.04, 0.004, 4).at((0, 0, 0.011))
    hole = rounded_box(0.10, 0.055, 0.012, 0.025, 0.003).at((-0.33 * long, 0, 0.097))
    pale = (0.9, 0.9, 0.88) if rng.random() < 0.6 else (0.1, 0.1, 0.1)
    laces = [Part(box(0.012, 0.06, 0.006).at((0.02 + 0.025 * k, 0, 0.086 - 0.006 * k)), pale)
             for k in range(3)]  # fmt: skip
    parts = [Part(upper, color), Part(sole, pale), Part(hole, shade(color, 0.3)), *laces]
    return assemble("shoe", parts, [box_shape((-long / 2, -0.045, 0), (long / 2, 0.045, 0.1))])


def _instep(high: float) -> list[tuple[float, float]]:
    """Half-width and height around a section, counter-clockwise seen from the toe."""
    return [(1.0, 0.015), (0.95, high * 0.55), (0.55, high), (-0.55, high), (-0.95, high * 0.55),
            (-1.0, 0.015)]  # fmt: skip


def make_hammer(rng: Generator) -> Asset:
    """A hammer lying on its side, or a screwdriver with a thick grip."""
    color = hsv(rng.choice([0.0, 0.6, 0.1, 0.3]), 0.8, rng.uniform(0.3, 0.8))
    lying = (0.0, math.pi / 2, 0.0)
    if rng.random() < 0.5:
        grip = lathe([(0.010, 0), (0.016, 0.02), (0.013, 0.09), (0.008, 0.11)], 8)
        blade = cylinder(0.004, 0.13, 6).at((0.16, 0, 0.016), lying)
        parts = [Part(grip.at((0, 0, 0.016), lying), color), Part(blade, STEEL, roughness=0.4)]
        return assemble("hammer", parts, [box_shape((0, -0.016, 0), (0.22, 0.016, 0.032))])
    shaft = cylinder(0.013, 0.30, 8).at((0, 0, 0.018), lying)
    head = box(0.035, 0.11, 0.034).at((0.15, 0, 0.018))
    wood = Part(shaft, pick(rng, [(0.7, 0.52, 0.3), color], 0.02))
    shape = box_shape((-0.15, -0.055, 0), (0.17, 0.055, 0.036))
    return assemble("hammer", [wood, Part(head, (0.25, 0.25, 0.27), roughness=0.5)], [shape])


def make_backpack(rng: Generator) -> Asset:
    """A rucksack of 0.4 to 0.5 m, pocket towards +x."""
    color = hsv(rng.random(), rng.uniform(0.1, 0.8), rng.uniform(0.15, 0.6))
    high = rng.uniform(0.40, 0.50)
    shape = [(-0.13, 0.0), (0.13, 0.0), (0.155, 0.12), (0.15, high - 0.12), (0.10, high - 0.02),
             (0.0, high), (-0.10, high - 0.02), (-0.15, high - 0.12), (-0.155, 0.12)]  # fmt: skip
    body = slab(shape, 0.2).at((0, 0, 0), (0, 0, math.pi / 2))
    pocket = rounded_box(0.06, 0.24, 0.17, 0.03, 0.02).at((0.11, 0, 0.12))
    bow = arc(0.15, 2.0, 4.3, 7, 1.2)
    straps = [tube(np.add(bow, [0.0, s * 0.08, high * 0.5]), 0.012, 5) for s in (-1, 1)]
    cloth = mottled(rng, color, 0.06, roughness=0.5)
    parts = [Part(body, texture=cloth), Part(pocket, shade(color, 0.8))]
    parts += [Part(strap, (0.08, 0.08, 0.09)) for strap in straps]
    return assemble("backpack", parts, [box_shape((-0.16, -0.16, 0), (0.14, 0.16, high))])


def make_lemon(rng: Generator) -> Asset:
    """A lemon, a lime or a pear: pointed, so that nobody takes it for a ball."""
    hue = float(rng.choice([0.16, 0.25, 0.20]))
    color = hsv(hue + rng.uniform(-0.02, 0.02), 0.75, rng.uniform(0.55, 0.85))
    profile = np.array([(0.0, -0.046), (0.007, -0.042), (0.018, -0.032), (0.027, -0.012),
                        (0.027, 0.010), (0.019, 0.030), (0.008, 0.042), (0.0, 0.046)])  # fmt: skip
    fruit = lathe(profile, 14).at((0, 0, 0.027), (0, math.pi / 2, 0))
    part = Part(fruit, texture=mottled(rng, color, 0.05), roughness=0.6)
    return assemble("lemon", [part], [box_shape((-0.046, -0.027, 0), (0.046, 0.027, 0.054))])


def make_plant(rng: Generator) -> Asset:
    """A pot with leaves, 0.3 to 0.6 m."""
    radius, high = rng.uniform(0.09, 0.14), rng.uniform(0.16, 0.22)
    clay = pick(rng, [(0.65, 0.32, 0.20), PAPER, (0.2, 0.2, 0.22)], 0.04)
    pot = lathe([(0, 0), (radius * 0.75, 0), (radius, high), (radius * 0.9, high),
                 (0, high - 0.02)], 16)  # fmt: skip
    green = hsv(rng.uniform(0.26, 0.36), 0.6, rng.uniform(0.25, 0.5))
    leaves: list[Surface] = []
    for index in range(11):
        leaf = ball(1.0, 1).scaled((0.04, 0.014, rng.uniform(0.10, 0.18))).at((0, 0, 0.13))
        leaves.append(leaf.at((0, 0, high - 0.02), (0, rng.uniform(0.1, 0.9), index * 2.4)))
    parts = [Part(pot, clay), *(Part(leaf, shade(green, rng.uniform(0.7, 1.2))) for leaf in leaves)]
    return assemble("plant", parts, [cylinder_shape(radius, 0, high + 0.2)])
