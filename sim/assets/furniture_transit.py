"""Hallways and elevators: closed doors, notice boards, signs, sliding doors and cabins."""

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
    furniture,
    picture,
    post,
    wood_or_paint,
)  # fmt: skip
from sim.assets.surface import cylinder, lathe
from sim.assets.texture import Color, canvas, from_image, hsv, pick, shade, to_rgb8

BRUSHED: list[Color] = [STEEL, (0.60, 0.58, 0.52), (0.75, 0.74, 0.72), (0.55, 0.42, 0.22)]


def make_closed_door(rng: Generator) -> Asset:
    """A closed door in its frame with a handle and mostly a plate, towards +x."""
    wide, high = rng.uniform(0.85, 1.0), rng.uniform(2.0, 2.15)
    leaf, frame = wood_or_paint(rng), pick(rng, [GREY, WHITE, BLACK], 0.05)
    side = 1 if rng.random() < 0.5 else -1
    parts = [
        block((0.05, wide + 0.14, high + 0.07), (0, 0, high / 2 + 0.035), frame),
        block((0.07, wide, high), (0, 0, high / 2), leaf, 0.6),
        block((0.06, 0.12, 0.025), (0.05, side * (wide / 2 - 0.12), 1.02), STEEL, 0.3),
    ]
    if rng.random() < 0.4:
        parts.append(block((0.08, 0.14, 0.7), (0, -side * wide * 0.2, 1.45), (0.5, 0.6, 0.65), 0.2))
    if rng.random() < 0.6:
        plate = block((0.02, 0.18, 0.12), (0.01, -side * (wide / 2 + 0.25), 1.5), WHITE)
        parts.append(plate)
    return furniture("closed door", parts)


def make_notice_board(rng: Generator) -> Asset:
    """A cork board with sheets of paper, towards +x."""
    wide, high = rng.uniform(0.8, 1.6), rng.uniform(0.7, 1.0)
    image, draw = canvas(pick(rng, [(0.6, 0.45, 0.3), (0.3, 0.4, 0.55)], 0.03), 96, 64)
    for _ in range(int(rng.integers(4, 12))):
        x, y = int(rng.integers(2, 76)), int(rng.integers(2, 44))
        sheet = pick(rng, [WHITE, WHITE, (0.95, 0.9, 0.5), (0.6, 0.8, 0.9)], 0.02)
        draw.rectangle((x, y, x + 14, y + 18), fill=to_rgb8(sheet))
        draw.line((x + 2, y + 5, x + 11, y + 5), fill=(60, 60, 60))
    frame = block((0.03, wide + 0.06, high + 0.06), (0, 0, 1.5), shade(GREY, 0.8))
    return furniture(
        "notice board", [frame, picture((wide, high), (0.015, 0, 1.5), from_image(image))]
    )


def make_extinguisher(rng: Generator) -> Asset:
    """A fire extinguisher on a wall under its sign, towards +x."""
    body = lathe([(0.07, 0), (0.08, 0.05), (0.08, 0.4), (0.03, 0.48), (0.03, 0.52)], 12)
    low = rng.uniform(0.5, 0.9)
    parts = [
        Part(body.at((0.05, 0, low)), (0.75, 0.06, 0.05), roughness=0.4),
        block((0.02, 0.05, 0.14), (0.1, 0.03, low + 0.5), BLACK),
        block((0.01, 0.2, 0.2), (-0.03, 0, low + 1.0), (0.8, 0.05, 0.05)),
    ]
    return furniture("extinguisher", parts)


def make_exit_sign(rng: Generator) -> Asset:
    """A green sign that hangs from the ceiling, or sits on a wall, seen along x."""
    image, draw = canvas((0.02, 0.5, 0.25), 48, 24)
    draw.polygon([(30, 5), (42, 12), (30, 19)], fill=(240, 240, 240))
    draw.rectangle((10, 9, 30, 15), fill=(240, 240, 240))
    middle = rng.uniform(2.2, 2.35)
    return furniture("exit sign", [picture((0.4, 0.2), (0, 0, middle), from_image(image))])


def make_bench_seat(rng: Generator) -> Asset:
    """A row of waiting chairs or a plain bench, facing +x."""
    seats, color = int(rng.integers(2, 5)), hsv(rng.random(), rng.uniform(0, 0.7), 0.5)
    parts = [block((0.06, seats * 0.55, 0.06), (0, 0, 0.36), BLACK)]
    for index in range(seats):
        y = (index + 0.5) * 0.55 - seats * 0.275
        parts.append(block((0.45, 0.48, 0.05), (0, y, 0.43), color))
        parts.append(block((0.05, 0.48, 0.4), (-0.22, y, 0.68), color))
    parts += [block((0.4, 0.05, 0.4), (0, s * seats * 0.2, 0.2), BLACK) for s in (-1, 1)]
    return furniture("bench seat", parts)


def make_water_cooler(rng: Generator) -> Asset:
    """A dispenser with a blue bottle on it."""
    body = block((0.32, 0.32, 1.0), (0, 0, 0.5), pick(rng, [WHITE, GREY], 0.02), 0.5)
    bottle = lathe([(0.05, 1.0), (0.13, 1.08), (0.13, 1.38), (0.1, 1.42)], 12)
    return furniture("water cooler", [body, Part(bottle, (0.4, 0.62, 0.85), roughness=0.2)])


def make_lift_doors(rng: Generator) -> Asset:
    """Two sliding doors of metal in a wide frame with call buttons and a floor display."""
    wide, high = rng.uniform(0.9, 1.3), rng.uniform(2.05, 2.2)
    metal, frame = pick(rng, BRUSHED, 0.03), pick(rng, [*BRUSHED, BLACK, WHITE], 0.03)
    sides = [(s * (wide / 2 + 0.1), s) for s in (-1, 1)]
    parts = [block((0.12, 0.2, high + 0.2), (0, y, (high + 0.2) / 2), frame, 0.3) for y, _ in sides]
    parts.append(block((0.12, wide + 0.4, 0.25), (0, 0, high + 0.125), frame, 0.3))
    for s in (-1, 1):
        leaf = (0.05, wide / 2 - 0.008, high)
        parts.append(block(leaf, (-0.01, s * wide / 4, high / 2), metal, 0.25))
    parts.append(block((0.06, 0.012, high), (-0.01, 0, high / 2), shade(metal, 0.3)))
    parts.append(block((0.02, 0.3, 0.12), (0.06, 0, high + 0.13), BLACK, 0.3))
    digit = pick(rng, [(1.0, 0.3, 0.1), (0.3, 0.7, 1.0), (1.0, 0.8, 0.2)], 0.0)
    parts.append(block((0.03, 0.06, 0.07), (0.06, 0, high + 0.13), digit))
    return furniture("lift doors", parts + _buttons(rng, wide / 2 + 0.36, 1.05, 2))


def _buttons(rng: Generator, y: float, low: float, number: int) -> list[Part]:
    parts = [block((0.02, 0.12, 0.1 * number + 0.1), (0.0, y, low + 0.05 * number), STEEL, 0.3)]
    for index in range(number):
        lit: Color = (1.0, 0.75, 0.3) if rng.random() < 0.3 else (0.9, 0.9, 0.9)
        button = cylinder(0.025, 0.02, 8).at((0.015, y, low + 0.1 * index), (0, math.pi / 2, 0))
        parts.append(Part(button, lit))
    return parts


def make_cabin_wall(rng: Generator) -> Asset:
    """One wall of a lift's cabin, 2 m wide: panels, a handrail, maybe a mirror or the buttons."""
    metal = pick(rng, [*BRUSHED, (0.45, 0.3, 0.18)], 0.04)
    edges = np.linspace(-1.0, 1.0, int(rng.integers(3, 6)))
    parts: list[Part] = []
    for left, right in itertools.pairwise(edges):
        size = (0.03, float(right - left) - 0.02, 2.2)
        parts.append(block(size, (0, float(left + right) / 2, 1.12), metal, 0.25))
    parts.append(block((0.02, 2.0, 2.3), (-0.02, 0, 1.15), shade(metal, 0.4)))
    rail = cylinder(0.02, 1.8, 8).at((0.08, 0, 0.9), (math.pi / 2, 0, 0))
    parts.append(Part(rail, STEEL, roughness=0.2))
    if rng.random() < 0.4:
        parts.append(block((0.02, 1.6, 1.0), (0.02, 0, 1.55), (0.62, 0.68, 0.72), 0.1))
    elif rng.random() < 0.5:
        parts += _buttons(rng, 0.6, 0.95, int(rng.integers(4, 8)))
    return furniture("cabin wall", parts)


def make_ash_stand(rng: Generator) -> Asset:
    """A slim metal bin as it stands beside lifts."""
    color = pick(rng, [STEEL, BLACK], 0.03)
    return furniture("ash stand", [post(0.14, (0, 0, 0), rng.uniform(0.55, 0.8), color, 0.3)])
