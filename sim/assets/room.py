"""The inside of a room: floor, walls with doors, windows and pictures, ceiling."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Asset, Part, assemble
from sim.assets.building import BRICK
from sim.assets.surface import box
from sim.assets.texture import Color, Texture, bricks, fractal, hsv, mixed, mottled, pick, shade

PAINT: list[Color] = [(0.90, 0.88, 0.83), (0.82, 0.84, 0.84), (0.72, 0.78, 0.80),
                      (0.85, 0.78, 0.62), (0.62, 0.70, 0.60), (0.75, 0.60, 0.52),
                      (0.45, 0.52, 0.60)]  # fmt: skip
BOARDS: list[Color] = [(0.60, 0.42, 0.25), (0.42, 0.28, 0.17), (0.75, 0.62, 0.44)]
STONE: list[Color] = [(0.78, 0.76, 0.72), (0.55, 0.55, 0.55), (0.65, 0.50, 0.40)]
FLOOR_TILE = 2.4
"""Side of one repetition of a room's floor [m]."""
_wall = 0.1


def room_floor(rng: Generator) -> Texture:
    """Planks, tiles, carpet or linoleum (256, 256, 3), 2.4 m wide."""
    kinds = (_planks, _tiles, _carpet, _linoleum)
    return kinds[int(rng.integers(len(kinds)))](rng)


def _planks(rng: Generator) -> Texture:
    wood = pick(rng, BOARDS, 0.03)
    row = np.arange(256) // 16
    tone = rng.normal(0, 0.10, 16)[row][:, None] + 0.10 * np.repeat(
        fractal(rng, 256, 0.7)[:, :32], 8, axis=1
    )
    joint = (np.arange(256) % 16 == 0)[:, None]
    return mixed(0.6 + tone - 0.35 * joint, shade(wood, 0.5), shade(wood, 1.2))


def _tiles(rng: Generator) -> Texture:
    step = int(rng.choice([32, 64]))
    stone, joint = pick(rng, STONE, 0.03), pick(rng, [(0.5, 0.5, 0.48), (0.8, 0.8, 0.78)], 0.02)
    index = np.arange(256) // step
    chequered = (index[:, None] + index[None]) % 2 * rng.choice([0.0, 0.0, 0.5])
    light = mixed(0.75 - chequered + 0.04 * fractal(rng, 256, 0.8), shade(stone, 0.3), stone)
    seam = (np.arange(256)[:, None] % step < 2) | (np.arange(256)[None] % step < 2)
    return np.where(seam[..., None], (np.array(joint) * 255).astype(np.uint8), light)


def _carpet(rng: Generator) -> Texture:
    color = hsv(rng.random(), rng.uniform(0.05, 0.45), rng.uniform(0.25, 0.65))
    return mottled(rng, color, 0.12, 256, roughness=0.3)


def _linoleum(rng: Generator) -> Texture:
    color = pick(rng, [(0.60, 0.62, 0.58), (0.72, 0.68, 0.58), (0.42, 0.48, 0.52)], 0.03)
    return mottled(rng, color, 0.04, 256, roughness=0.8)


def make_room(rng: Generator, x: float, y: float, height: float) -> Asset:
    """Four walls around a floor of x by y [m] that is centred at the origin, and a ceiling."""
    parts = [*_walls(rng, x, y, height), *_ceiling(rng, x, y, height)]
    for side in range(4):
        long, reach = ((y, x), (x, y))[side % 2]
        hung = _hangings(rng, long, height)
        turn = side * math.pi / 2
        out = np.array([math.cos(turn), math.sin(turn), 0]) * (reach / 2 - 0.012)
        parts += [Part(p.surface.at((0, 0, 0), (0, 0, turn)).at(out), p.color, p.texture)
                  for p in hung]  # fmt: skip
    return assemble("room", parts, [])


def _walls(rng: Generator, x: float, y: float, height: float) -> list[Part]:
    """One texture all round, another on one wall now and then; a skirting board."""
    papers = [_paper(rng)] * 4
    if rng.random() < 0.4:
        papers[int(rng.integers(4))] = _paper(rng)
    board = pick(rng, [(0.92, 0.92, 0.90), (0.30, 0.20, 0.13), (0.5, 0.5, 0.5)], 0.02)
    parts: list[Part] = []
    for side, paper in enumerate(papers):
        long, reach = ((y, x), (x, y))[side % 2]
        turn = side * math.pi / 2
        out = np.array([math.cos(turn), math.sin(turn), 0])
        panel = box(_wall, long + 2 * _wall, height).tiled(long / 1.5, height / 1.5)
        at = out * (reach + _wall) / 2 + [0, 0, height / 2]
        parts.append(Part(panel.at((0, 0, 0), (0, 0, turn)).at(at), texture=paper))
        skirting = box(0.02, long, 0.09).at((0, 0, 0.045), (0, 0, turn)).at(out * reach / 2)
        parts.append(Part(skirting, board))
    return parts


def _paper(rng: Generator) -> Texture:
    """What covers a wall, 1.5 m wide."""
    kind, color = rng.random(), pick(rng, PAINT, 0.04)
    if kind < 0.6:
        return mottled(rng, color, 0.02, 128, roughness=1.2)
    if kind < 0.75:
        stripe = np.tile((np.arange(128) // 8 % 2)[None], (128, 1)).astype(float)
        return mixed(stripe, color, shade(color, rng.uniform(0.8, 0.93)))
    if kind < 0.88:
        return bricks(rng, pick(rng, [*BRICK, (0.88, 0.87, 0.85)], 0.02), (0.75, 0.72, 0.68), 16)
    return bricks(rng, shade(color, 1.05), shade(color, 0.7), 8)


def _ceiling(rng: Generator, x: float, y: float, height: float) -> list[Part]:
    top = box(x + 0.2, y + 0.2, 0.1).at((0, 0, height + 0.05))
    lamps = [
        box(0.6, 0.6, 0.03).at((a * x * 0.25, b * y * 0.25, height - 0.01))
        for a in (-1, 1)
        for b in (-1, 1)
        if rng.random() < 0.7
    ]
    return [Part(top, (0.95, 0.95, 0.94)), *(Part(lamp, (1.0, 1.0, 0.97)) for lamp in lamps)]


def _hangings(rng: Generator, long: float, height: float) -> list[Part]:
    """Doors, windows, pictures of a wall that stands at x = 0 along y."""
    parts: list[Part] = []
    y = -long / 2 + rng.uniform(0.3, 1.0)
    while y < long / 2 - 1.1:
        kind = rng.random()
        if kind < 0.2:
            parts += _door(rng, y + 0.5)
        elif kind < 0.5:
            parts += _window(rng, y + 0.5, height)
        elif kind < 0.8:
            parts += _picture(rng, y + 0.5)
        y += rng.uniform(1.1, 1.9)
    return parts


def _door(rng: Generator, y: float) -> list[Part]:
    color = pick(rng, [(0.55, 0.38, 0.22), (0.85, 0.85, 0.83), (0.35, 0.40, 0.45)], 0.03)
    leaf = box(0.02, 0.88, 2.02).at((0, y, 1.01))
    frame = box(0.015, 1.0, 2.1).at((0, y, 1.05))
    knob = box(0.05, 0.12, 0.03).at((-0.03, y + 0.35, 1.02))
    return [Part(frame, shade(color, 0.7)), Part(leaf, color), Part(knob, (0.7, 0.7, 0.7))]


def _window(rng: Generator, y: float, height: float) -> list[Part]:
    wide, high = rng.uniform(0.7, 1.0), rng.uniform(0.9, 1.2)
    middle = min(1.5, height - high / 2 - 0.2)
    light = shade((0.75, 0.85, 0.97), rng.uniform(0.25, 1.05))
    frame = pick(rng, [(0.93, 0.93, 0.92), (0.35, 0.25, 0.17)], 0.02)
    bars = [box(0.03, 0.03, high).at((0, y, middle)), box(0.03, wide, 0.03).at((0, y, middle))]
    return [
        Part(box(0.015, wide + 0.1, high + 0.1).at((0, y, middle)), frame),
        Part(box(0.02, wide, high).at((0, y, middle)), light, roughness=0.3),
        *(Part(bar, frame) for bar in bars),
    ]


def _picture(rng: Generator, y: float) -> list[Part]:
    """A framed blot of colours, or a board."""
    wide, high = rng.uniform([0.3, 0.3], [1.0, 0.8])
    first, second = hsv(rng.random(), 0.6, 0.7), hsv(rng.random(), 0.5, 0.4)
    print_ = mixed(0.5 + 0.5 * fractal(rng, 64, 1.3), first, second)
    if rng.random() < 0.3:
        print_ = mottled(rng, (0.95, 0.95, 0.94), 0.01)
    frame = pick(rng, [(0.1, 0.1, 0.1), (0.5, 0.35, 0.2), (0.9, 0.9, 0.9)], 0.02)
    at = (0, y, 1.5)
    return [
        Part(box(0.02, wide + 0.06, high + 0.06).at(at), frame),
        Part(box(0.03, wide, high).at(at), texture=print_),
    ]
