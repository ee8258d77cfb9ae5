"""Lounges: sofas and armchairs around low tables, rugs, lamps, television sets and pictures."""

from __future__ import annotations

from numpy.random import Generator
from PIL import Image

from sim.assets.asset import Asset, Part
from sim.assets.furniture_parts import (
    BLACK,
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
from sim.assets.surface import box, lathe
from sim.assets.texture import (
    Color,
    Texture,
    canvas,
    fractal,
    from_image,
    hsv,
    mixed,
    pick,
    shade,
    to_rgb8,
)  # fmt: skip


def make_sofa(rng: Generator) -> Asset:
    """A sofa along y for two or three, facing +x."""
    return furniture("sofa", _upholstered(rng, int(rng.integers(2, 4)), fabric(rng)))


def make_armchair(rng: Generator) -> Asset:
    """An armchair facing +x."""
    return furniture("armchair", _upholstered(rng, 1, fabric(rng)))


def _upholstered(rng: Generator, seats: int, color: Color) -> list[Part]:
    seat, back, arm = rng.uniform(0.36, 0.44), rng.uniform(0.72, 0.92), rng.uniform(0.12, 0.22)
    inner = seats * rng.uniform(0.55, 0.68)
    wide = inner + 2 * arm
    parts = [
        block((0.8, wide, seat - 0.18), (0, 0, 0.08 + (seat - 0.18) / 2), shade(color, 0.8)),
        block((0.22, wide, back - 0.1), (-0.32, 0, 0.05 + back / 2), color),
    ]
    for s in (-1, 1):
        height = seat + rng.uniform(0.12, 0.2)
        parts.append(block((0.8, arm, height - 0.06), (0, s * (wide - arm) / 2, height / 2), color))
    each = inner / seats
    for index in range(seats):
        y = (index + 0.5) * each - inner / 2
        parts.append(block((0.6, each - 0.02, 0.14), (0.1, y, seat - 0.04), shade(color, 1.1)))
        parts.append(block((0.14, each - 0.03, 0.34), (-0.18, y, seat + 0.2), shade(color, 1.1)))
    if rng.random() < 0.6:
        cushion = box(0.12, 0.36, 0.34).at((-0.05, rng.uniform(-0.3, 0.3) * inner, seat + 0.2))
        parts.append(Part(cushion, fabric(rng)))
    return parts


def make_low_table(rng: Generator) -> Asset:
    """A coffee table with magazines, on a rug half of the time."""
    x, y, top = rng.uniform(0.5, 0.8), rng.uniform(0.7, 1.3), rng.uniform(0.34, 0.45)
    color = wood_or_paint(rng)
    parts = [block((x, y, 0.04), (0, 0, top), color, 0.5)]
    parts += legs(x / 2 - 0.05, y / 2 - 0.05, top, shade(color, 0.7))
    for _ in range(int(rng.integers(0, 4))):
        at = (rng.uniform(-0.15, 0.15), rng.uniform(-0.3, 0.3), top + 0.03)
        parts.append(block((0.2, 0.28, 0.012), at, hsv(rng.random(), 0.6, 0.7), 0.5))
    if rng.random() < 0.5:
        parts.append(_rug(rng, x + rng.uniform(0.8, 1.6), y + rng.uniform(0.8, 1.6)))
    return furniture("low table", parts)


def _rug(rng: Generator, x: float, y: float) -> Part:
    one, other = fabric(rng), fabric(rng)
    return Part(
        box(x, y, 0.012).at((0, 0, 0.006)), texture=mixed(fractal(rng, 32, 0.8), one, other)
    )


def make_lamp(rng: Generator) -> Asset:
    """A floor lamp with a shade."""
    high = rng.uniform(1.4, 1.8)
    cover = lathe([(0.22, high - 0.28), (0.14, high)], 14)
    parts = [
        post(0.15, (0, 0, 0), 0.03, BLACK),
        post(0.015, (0, 0, 0.03), high - 0.2, pick(rng, [BLACK, STEEL])),
        Part(cover, pick(rng, [(1.0, 0.95, 0.8), (0.95, 0.8, 0.55), (0.9, 0.9, 0.9)])),
    ]
    return furniture("lamp", parts)


def make_television(rng: Generator) -> Asset:
    """A television set on a low board, screen towards +x."""
    wide = rng.uniform(0.9, 1.4)
    color, high = wood_or_paint(rng), wide * 0.56
    parts = [
        block((0.4, wide + 0.4, 0.42), (0, 0, 0.21), color),
        block((0.05, wide, high), (-0.05, 0, 0.52 + high / 2), BLACK, 0.3),
        picture((wide - 0.04, high - 0.04), (-0.02, 0, 0.52 + high / 2), painting(rng)),
    ]
    return furniture("television", parts)


def make_painting(rng: Generator) -> Asset:
    """A framed picture on a wall, towards +x."""
    wide, high, middle = rng.uniform(0.4, 1.2), rng.uniform(0.4, 0.9), rng.uniform(1.4, 1.7)
    frame = pick(rng, [BLACK, WHITE, (0.5, 0.35, 0.15)], 0.03)
    parts = [
        block((0.03, wide + 0.06, high + 0.06), (0, 0, middle), frame),
        picture((wide, high), (0.015, 0, middle), painting(rng)),
    ]
    return furniture("painting", parts)


def painting(rng: Generator) -> Texture:
    """Clouds of two colours with a few figures."""
    one, other = fabric(rng), fabric(rng)
    image, draw = canvas(one, 64, 64)
    image.paste(Image.fromarray(mixed(0.5 + 0.4 * fractal(rng, 64, 1.4), one, other)))
    for _ in range(int(rng.integers(0, 4))):
        x, y, size = (int(value) for value in rng.integers([0, 0, 6], [50, 50, 24]))
        draw.ellipse((x, y, x + size, y + size), fill=to_rgb8(fabric(rng)))
    return from_image(image)
