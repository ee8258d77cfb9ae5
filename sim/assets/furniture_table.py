"""Where many sit together: conference tables, cafeteria tables, serving counters and machines."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part
from sim.assets.furniture_office import windows
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
from sim.assets.surface import Surface, join
from sim.assets.texture import Color, canvas, from_image, hsv, pick, shade


def make_conference_table(rng: Generator) -> Asset:
    """A long table along y with chairs all round, papers, and mostly a conference telephone."""
    seats = int(rng.integers(3, 7))
    long, deep = seats * 0.72 + 0.2, rng.uniform(1.0, 1.4)
    color, cover = wood_or_paint(rng), pick(rng, [BLACK, fabric(rng)], 0.02)
    parts = [block((deep, long, 0.05), (0, 0, 0.73), color, 0.4)]
    for s in (-1, 1):
        parts.append(
            block((deep * 0.5, 0.08, 0.7), (0, s * (long / 2 - 0.5), 0.35), shade(color, 0.7))
        )
    chairs = [
        (s * (deep / 2 + 0.15), (i + 0.5) * 0.72 - seats * 0.36, s)
        for i in range(seats)
        for s in (-1, 1)
    ]
    for x, y, side in chairs:
        if rng.random() < 0.92:
            parts += chair((x, y), math.pi if side > 0 else 0.0, cover, rng.uniform(0.3, 0.5))
    for _ in range(int(rng.integers(0, 6))):
        at = (rng.uniform(-0.3, 0.3) * deep, rng.uniform(-0.4, 0.4) * long, 0.765)
        parts.append(block((0.21, 0.3, 0.02), at, pick(rng, [WHITE, GREY, BLACK])))
    if rng.random() < 0.7:
        parts.append(post(0.12, (0, 0, 0.755), 0.05, BLACK))
    return furniture("conference table", parts)


def make_cafeteria_table(rng: Generator) -> Asset:
    """A small table, round or square, with four chairs on thin legs."""
    side, color = rng.uniform(0.7, 0.95), wood_or_paint(rng)
    cover = hsv(rng.random(), rng.uniform(0.1, 0.85), rng.uniform(0.3, 0.9))
    parts = [post(0.04, (0, 0, 0), 0.72, STEEL), post(0.25, (0, 0, 0), 0.03, STEEL)]
    if rng.random() < 0.5:
        parts.append(post(side / 2, (0, 0, 0.72), 0.03, color))
    else:
        parts.append(block((side, side, 0.03), (0, 0, 0.735), color, 0.5))
    for quarter in range(4):
        angle = quarter * math.pi / 2
        reach = side / 2 + rng.uniform(0.08, 0.2)
        at = (reach * math.cos(angle), reach * math.sin(angle))
        parts += chair(at, angle + math.pi, cover, 0.36)
    for _ in range(int(rng.integers(0, 3))):
        at = (*rng.uniform(-0.2, 0.2, 2).tolist(), 0.76)
        parts.append(block((0.3, 0.4, 0.02), at, hsv(rng.random(), 0.5, 0.6), 0.5))
    return furniture("cafeteria table", parts)


def chair(at: tuple[float, float], yaw: float, color: Color, back: float) -> list[Part]:
    """A chair at a point, facing along yaw; `back` is the height of its back [m]."""
    pieces = [
        block((0.42, 0.42, 0.05), (0, 0, 0.45), color),
        block((0.04, 0.4, back), (-0.2, 0, 0.47 + back / 2), color),
        *legs(0.18, 0.18, 0.43, STEEL, 0.025),
    ]
    seat = join([piece.surface for piece in pieces[:2]])
    frame = join([piece.surface for piece in pieces[2:]])
    return [Part(_turned(seat, yaw, at), color), Part(_turned(frame, yaw, at), STEEL)]


def _turned(surface: Surface, yaw: float, at: tuple[float, float]) -> Surface:
    return surface.at((*at, 0.0), (0.0, 0.0, yaw))


def make_wall_screen(rng: Generator) -> Asset:
    """A large screen on a wall, or the white cloth of a projector, towards +x."""
    wide = rng.uniform(1.3, 2.4)
    high, middle = wide * 0.57, 1.5
    if rng.random() < 0.4:
        cloth = block((0.02, wide, high), (0, 0, middle), (0.95, 0.95, 0.95))
        return furniture(
            "wall screen", [cloth, block((0.08, wide + 0.1, 0.08), (0, 0, middle + high / 2), GREY)]
        )
    frame = block((0.05, wide, high), (0, 0, middle), BLACK, 0.3)
    shown = picture((wide - 0.05, high - 0.05), (0.03, 0, middle), windows(rng))
    return furniture("wall screen", [frame, shown])


def make_serving_counter(rng: Generator) -> Asset:
    """A counter with a glass cover, trays, and a rail before it, towards +x."""
    long = rng.uniform(1.8, 3.6)
    front = pick(rng, [STEEL, wood_or_paint(rng), hsv(rng.random(), 0.4, 0.6)], 0.02)
    parts = [
        block((0.7, long, 0.88), (0, 0, 0.44), front, 0.5),
        block((0.75, long, 0.04), (0, 0, 0.9), STEEL, 0.3),
        block((0.02, long, 0.35), (0.15, 0, 1.2), (0.62, 0.72, 0.75), 0.1),
        block((0.45, long, 0.03), (-0.05, 0, 1.4), STEEL, 0.3),
    ]
    parts += [block((0.03, long, 0.03), (0.45 + 0.08 * i, 0, 0.86), STEEL, 0.3) for i in range(3)]
    for y in np.arange(-long / 2 + 0.25, long / 2 - 0.1, 0.42):
        food = hsv(rng.uniform(0.02, 0.3), 0.7, rng.uniform(0.3, 0.8))
        parts.append(block((0.32, 0.34, 0.06), (-0.08, float(y), 0.94), food))
    return furniture("serving counter", parts)


def make_vending_machine(rng: Generator) -> Asset:
    """A machine with rows of goods behind a pane, towards +x."""
    color = hsv(rng.random(), rng.uniform(0.3, 0.9), rng.uniform(0.2, 0.7))
    image, draw = canvas((0.1, 0.1, 0.12), 60, 90)
    for row in range(6):
        for column in range(6):
            good = hsv(rng.random(), 0.8, 0.9)
            x, y = 3 + 9 * column, 4 + 14 * row
            draw.rectangle((x, y, x + 6, y + 10), fill=tuple(int(255 * c) for c in good))
    parts = [
        block((0.75, 0.95, 1.83), (0, 0, 0.92), color, 0.5),
        picture((0.62, 1.3), (0.38, -0.12, 1.05), from_image(image)),
        block((0.02, 0.15, 0.3), (0.38, 0.36, 1.1), BLACK, 0.3),
    ]
    return furniture("vending machine", parts)


def make_menu_board(rng: Generator) -> Asset:
    """A dark board with lines of text high on a wall, towards +x."""
    wide = rng.uniform(1.2, 2.4)
    image, draw = canvas(pick(rng, [(0.08, 0.1, 0.09), (0.15, 0.1, 0.08)], 0.02), 128, 48)
    for y in range(6, 44, 7):
        for x in (6, 70):
            draw.line((x, y, x + int(rng.integers(20, 50)), y), fill=(235, 230, 210), width=2)
    return furniture("menu board", [picture((wide, wide * 0.36), (0, 0, 2.0), from_image(image))])
