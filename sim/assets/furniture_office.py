"""Offices: desks with screens, swivel chairs, shelves, cabinets, boards, plants and bins."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part
from sim.assets.furniture_parts import (
    BLACK,
    GREY,
    STEEL,
    WHITE,
    block,
    fabric,
    furniture,
    legs,
    picture,
    post,
    wood_or_paint,
)  # fmt: skip
from sim.assets.surface import ball, cylinder, lathe
from sim.assets.texture import Color, Texture, canvas, fractal, from_image, hsv, mixed, pick, shade


def make_desk(rng: Generator) -> Asset:
    """A desk along y with one or two screens; whoever works there sits towards +x."""
    long, deep, top = rng.uniform(1.2, 1.8), rng.uniform(0.65, 0.8), rng.uniform(0.70, 0.76)
    color = wood_or_paint(rng)
    parts = [block((deep, long, 0.03), (0, 0, top), color, 0.6)]
    parts += legs(
        deep / 2 - 0.05, long / 2 - 0.05, top, pick(rng, [BLACK, STEEL, shade(color, 0.7)])
    )
    if rng.random() < 0.6:
        drawers = (deep - 0.1, 0.4, top - 0.1)
        parts.append(block(drawers, (0, long / 2 - 0.25, top / 2), shade(color, 0.9)))
    number = int(rng.integers(1, 3))
    for index in range(number):
        parts += _screen(rng, (index - (number - 1) / 2) * 0.58, top)
    parts.append(block((0.15, 0.42, 0.02), (0.12, 0, top + 0.025), pick(rng, [BLACK, WHITE])))
    return furniture("desk", parts + _papers(rng, long, top))


def _screen(rng: Generator, y: float, top: float) -> list[Part]:
    wide, high = rng.uniform(0.46, 0.58), rng.uniform(0.28, 0.34)
    middle = top + 0.18 + high / 2
    return [
        post(0.1, (-0.12, y, top + 0.015), 0.015, BLACK),
        block((0.03, 0.05, 0.25), (-0.14, y, top + 0.15), BLACK),
        block((0.03, wide, high), (-0.12, y, middle), BLACK, 0.3),
        picture((wide - 0.03, high - 0.03), (-0.11, y, middle), windows(rng)),
    ]


def windows(rng: Generator) -> Texture:
    """What a computer shows: a desktop with windows and lines of text, or nothing."""
    image, draw = canvas(hsv(rng.random(), rng.uniform(0, 0.7), rng.uniform(0.05, 0.7)), 96, 64)
    for _ in range(int(rng.integers(0, 4))):
        x, y = int(rng.integers(0, 60)), int(rng.integers(0, 40))
        ground = int(rng.choice([30, 245]))
        draw.rectangle((x, y, x + 38, y + 24), fill=(ground,) * 3)
        for line in range(y + 4, y + 22, 4):
            end = x + 4 + int(rng.integers(6, 30))
            draw.line((x + 3, line, end, line), fill=(275 - ground,) * 3)
    return from_image(image)


def _papers(rng: Generator, long: float, top: float) -> list[Part]:
    parts: list[Part] = []
    for _ in range(int(rng.integers(1, 5))):
        y, x = rng.uniform(-long / 2 + 0.2, long / 2 - 0.2), rng.uniform(-0.1, 0.25)
        thick = rng.uniform(0.005, 0.08)
        color = pick(rng, [WHITE, WHITE, (0.3, 0.4, 0.6), (0.7, 0.3, 0.2)], 0.04)
        parts.append(block((0.21, 0.3, thick), (x, y, top + 0.015 + thick / 2), color))
    return parts


def make_office_chair(rng: Generator) -> Asset:
    """A swivel chair on five castors, facing +x."""
    color, seat = pick(rng, [BLACK, fabric(rng)], 0.02), rng.uniform(0.44, 0.5)
    parts = [post(0.03, (0, 0, 0.08), seat - 0.08, GREY)]
    for angle in np.arange(5) * 2 * math.pi / 5:
        arm = cylinder(0.02, 0.28, 6).at((0, 0, 0), (0, math.pi / 2, 0))
        at = (0.14 * math.cos(angle), 0.14 * math.sin(angle), 0.09)
        parts.append(Part(arm.at((0, 0, 0), (0, 0, angle)).at(at), BLACK))
        parts.append(post(0.03, (2 * at[0], 2 * at[1], 0.0), 0.06, BLACK))
    parts.append(block((0.46, 0.48, 0.08), (0, 0, seat), color))
    parts.append(block((0.06, 0.44, rng.uniform(0.45, 0.65)), (-0.24, 0, seat + 0.38), color))
    if rng.random() < 0.6:
        parts += [block((0.26, 0.05, 0.03), (0, s * 0.27, seat + 0.22), BLACK) for s in (-1, 1)]
    return furniture("office chair", parts)


def make_bookshelf(rng: Generator) -> Asset:
    """Shelves with books and files, front towards +x."""
    wide, high, deep = rng.uniform(0.7, 1.3), rng.uniform(1.2, 2.1), 0.32
    color = wood_or_paint(rng)
    parts = [block((0.02, wide, high), (-deep / 2, 0, high / 2), shade(color, 0.8))]
    parts += [block((deep, 0.025, high), (0, s * wide / 2, high / 2), color) for s in (-1, 1)]
    levels = np.linspace(0.06, high - 0.02, int(rng.integers(4, 7)))
    parts += [block((deep, wide, 0.025), (0, 0, float(z)), color) for z in levels]
    for z in levels[:-1]:
        parts += _books(rng, wide, float(z), float(levels[1] - levels[0]))
    return furniture("bookshelf", parts)


def _books(rng: Generator, wide: float, low: float, room: float) -> list[Part]:
    parts: list[Part] = []
    y = -wide / 2 + 0.04
    while y < wide / 2 - 0.12 and rng.random() < 0.95:
        thick, tall = rng.uniform(0.03, 0.09), room * rng.uniform(0.55, 0.85)
        color = hsv(rng.random(), rng.uniform(0, 0.8), rng.uniform(0.2, 0.9))
        parts.append(block((0.2, thick, tall), (0.02, y + thick / 2, low + tall / 2), color))
        y += thick + 0.004
    return parts


def make_cabinet(rng: Generator) -> Asset:
    """A filing cabinet with drawers, or a locker, front towards +x."""
    wide, high = rng.uniform(0.4, 0.9), rng.uniform(0.7, 1.9)
    color = pick(rng, [GREY, (0.75, 0.75, 0.72), (0.3, 0.33, 0.36), WHITE], 0.03)
    parts = [block((0.45, wide, high), (0, 0, high / 2), shade(color, 0.85), 0.6)]
    edges = np.linspace(0.03, high - 0.02, max(2, round(high / 0.35)))
    for low, top in itertools.pairwise(edges):
        middle = float(low + top) / 2
        size = (0.02, wide - 0.03, float(top - low) - 0.02)
        parts.append(block(size, (0.23, 0, middle), color, 0.5))
        parts.append(block((0.02, 0.14, 0.02), (0.25, 0, middle + 0.06), BLACK))
    return furniture("cabinet", parts)


def make_whiteboard(rng: Generator) -> Asset:
    """A white board with scribbles, hung on a wall, towards +x."""
    wide, high = rng.uniform(1.0, 2.2), rng.uniform(0.8, 1.2)
    image, draw = canvas(WHITE, 128, 64)
    for _ in range(int(rng.integers(0, 9))):
        x, y = int(rng.integers(4, 90)), int(rng.integers(4, 56))
        ink = hsv(float(rng.choice([0.0, 0.33, 0.62])), 0.8, 0.5)
        points = [(x + 7 * i, y + int(rng.integers(-4, 5))) for i in range(int(rng.integers(2, 6)))]
        draw.line(points, fill=tuple(int(255 * c) for c in ink), width=1)
    middle = 1.45
    parts = [
        block((0.03, wide + 0.05, high + 0.05), (0, 0, middle), STEEL),
        picture((wide, high), (0.015, 0, middle), from_image(image)),
        block((0.08, wide * 0.7, 0.02), (0.03, 0, middle - high / 2 - 0.02), STEEL),
    ]
    return furniture("whiteboard", parts)


def make_plant(rng: Generator) -> Asset:
    """A pot plant of 0.6 to 1.6 m."""
    high = rng.uniform(0.6, 1.6)
    pot = lathe([(0.11, 0), (0.17, 0.28), (0.18, 0.3)], 12)
    color = pick(rng, [(0.6, 0.35, 0.22), WHITE, (0.2, 0.2, 0.22)], 0.03)
    green = hsv(rng.uniform(0.24, 0.36), 0.65, rng.uniform(0.3, 0.5))
    leaves = mixed(0.5 + 0.3 * fractal(rng, 32, 0.4), shade(green, 0.4), shade(green, 1.2))
    parts = [Part(pot, color, roughness=0.6), post(0.02, (0, 0, 0.3), high * 0.5, (0.3, 0.2, 0.1))]
    for _ in range(int(rng.integers(4, 8))):
        at = (*rng.uniform(-0.16, 0.16, 2).tolist(), rng.uniform(0.45, 1.0) * high)
        leaf = ball(1.0, 1).scaled(rng.uniform(0.07, 0.24, 3)).at(at)
        parts.append(Part(leaf, texture=leaves))
    return furniture("plant", parts)


def make_waste_bin(rng: Generator) -> Asset:
    """A waste-paper basket."""
    high = rng.uniform(0.3, 0.65)
    color: Color = pick(rng, [BLACK, GREY, (0.2, 0.35, 0.6), STEEL], 0.03)
    tub = lathe([(0.11, 0), (0.15, high), (0.14, high), (0.12, high - 0.04), (0, high - 0.1)], 14)
    return furniture("waste bin", [Part(tub, color)])
