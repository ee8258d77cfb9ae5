"""More street furniture that is none of the classes, chosen because it is like one of them."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble, box_shape, cylinder_shape
from sim.assets.shapes import rounded_box
from sim.assets.surface import box, cylinder, lathe, loft
from sim.assets.texture import Color, bands, pick, shade

WHITE: Color = (0.93, 0.93, 0.91)


def make_mailbox(rng: Generator) -> Asset:
    """A letter box on a post or on legs, often red like a hydrant."""
    color = pick(rng, [(0.70, 0.06, 0.06), (0.08, 0.2, 0.55), (0.85, 0.68, 0.1)], 0.04)
    wide, deep, high = rng.uniform(0.3, 0.45), rng.uniform(0.28, 0.4), rng.uniform(0.4, 0.6)
    legs = rng.uniform(0.25, 0.7)
    angle = np.linspace(0, math.pi, 9)
    vault = [(wide / 2 * math.cos(a), high * 0.7 + wide / 2 * math.sin(a)) for a in angle]
    outline = [(-wide / 2, 0.0), (wide / 2, 0.0), *vault]
    rings = [[(x, y, z + legs) for y, z in outline] for x in (-deep / 2, deep / 2)]
    slot = box(0.02, wide * 0.6, 0.035).at((deep / 2, 0, legs + high * 0.75))
    plate = box(0.012, wide * 0.5, 0.12).at((deep / 2, 0, legs + high * 0.4))
    foot = box(0.10, 0.10, legs).at((0, 0, legs / 2))
    parts = [Part(loft(np.array(rings)), color, roughness=0.5), Part(slot, (0.05, 0.05, 0.05))]
    parts += [Part(plate, WHITE), Part(foot, shade(color, 0.5))]
    top = legs + high * 0.7 + wide / 2
    shape = box_shape((-deep / 2, -wide / 2, 0), (deep / 2, wide / 2, top))
    return assemble("mailbox", parts, [shape])


def make_delineator(rng: Generator) -> Asset:
    """A slim orange or white post with bands on a rubber foot, straight where a cone is not."""
    height, radius = rng.uniform(0.7, 1.1), rng.uniform(0.035, 0.055)
    color = pick(rng, [(0.93, 0.35, 0.06), (0.85, 0.12, 0.08), WHITE], 0.03)
    other = (0.80, 0.12, 0.08) if color[1] > 0.8 else WHITE
    stripes = [(0.6, 0.7, other), (0.78, 0.88, other)]
    pole = lathe([(radius, 0.04), (radius, height - 0.02), (radius * 0.8, height)], 12)
    foot = rounded_box(0.34, 0.34, 0.05, 0.08, 0.015).at((0, 0, 0.025))
    parts = [Part(pole, texture=bands(color, stripes)), Part(foot, (0.07, 0.07, 0.08))]
    return assemble("delineator", parts, [cylinder_shape(0.17, 0, height)])


def make_barrier(rng: Generator) -> Asset:
    """A striped board on two stands."""
    long, height = rng.uniform(1.0, 1.6), rng.uniform(0.85, 1.05)
    color = pick(rng, [(0.85, 0.15, 0.08), (0.92, 0.42, 0.06)], 0.03)
    stripe = np.tile((np.arange(64) // 8 % 2 == 0)[None], (8, 1))
    paint = np.where(stripe[..., None], np.array(color), np.array(WHITE)) * 255
    board = box(0.03, long, 0.22).at((0, 0, height - 0.11))
    parts = [Part(board, texture=paint.astype(np.uint8), roughness=0.6)]
    for side in (-1, 1):
        y = side * long * 0.4
        parts.append(Part(box(0.05, 0.05, height).at((-0.03, y, height / 2)), WHITE))
        parts.append(Part(box(0.5, 0.05, 0.05).at((0, y, 0.025)), shade(color, 0.7)))
    return assemble("barrier", parts, [box_shape((-0.25, -long / 2, 0), (0.25, long / 2, height))])


def make_lamp(rng: Generator) -> Asset:
    """A street or garden lamp of 1 to 3 m."""
    height, metal = rng.uniform(1.0, 3.0), pick(rng, [(0.12, 0.14, 0.14), (0.5, 0.5, 0.52)], 0.02)
    pole = lathe([(0.09, 0), (0.08, 0.05), (0.045, 0.3), (0.035, height)], 10)
    globe = lathe([(0.05, height), (0.13, height + 0.08), (0.13, height + 0.2),
                   (0.03, height + 0.28)], 12)  # fmt: skip
    hat = cylinder(0.15, 0.03, 12).at((0, 0, height + 0.28))
    parts = [Part(pole, metal), Part(globe, (0.95, 0.94, 0.85)), Part(hat, metal)]
    return assemble("lamp", parts, [cylinder_shape(0.09, 0, height)])
