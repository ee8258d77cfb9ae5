"""Packages from a kitchen shelf: cracker boxes and mustard bottles."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from PIL import Image, ImageDraw, ImageFont

from sim.assets.asset import Asset, Part, assemble, box_shape
from sim.assets.shapes import atlas_box
from sim.assets.surface import Surface, lathe
from sim.assets.texture import Color, Texture, bands, from_image, pick, shade, to_rgb8

BOXES: list[Color] = [(0.72, 0.06, 0.07), (0.78, 0.10, 0.05), (0.66, 0.04, 0.12),
                      (0.80, 0.30, 0.05)]  # fmt: skip
BISCUIT: Color = (0.87, 0.64, 0.30)
CREAM: Color = (0.97, 0.90, 0.62)
MUSTARD: list[Color] = [(0.93, 0.75, 0.06), (0.90, 0.68, 0.08), (0.96, 0.80, 0.15)]
_words = ("CRACKERS", "CRISPS", "BISCUITS", "SNACKS")


def make_cracker_box(rng: Generator) -> Asset:
    """A standing box of about 0.06 x 0.16 x 0.21 m, printed sides towards +x and -x."""
    x, y, z = rng.uniform([0.055, 0.145, 0.195], [0.072, 0.17, 0.225])
    front, side, end = _print(rng)
    atlas = Image.new("RGB", (384, 128))
    for column, picture in enumerate((front, side, end)):
        atlas.paste(picture.resize((128, 128)), (128 * column, 0))
    body = atlas_box(x, y, z).at((0, 0, z / 2))
    shape = box_shape((-x / 2, -y / 2, 0), (x / 2, y / 2, z))
    return assemble("cracker box", [Part(body, texture=from_image(atlas), roughness=0.75)], [shape])


def _print(rng: Generator) -> tuple[Image.Image, Image.Image, Image.Image]:
    """Front, narrow side and end of the box."""
    color, word = pick(rng, BOXES, 0.02), _words[int(rng.integers(len(_words)))]
    band = pick(rng, [CREAM, (0.96, 0.80, 0.15), (0.95, 0.95, 0.93)], 0.02)
    front = Image.new("RGB", (160, 210), to_rgb8(color))
    draw = ImageDraw.Draw(front)
    top = int(rng.integers(14, 34))
    draw.rectangle((0, top, 160, top + 46), fill=to_rgb8(band))
    _centred(draw, word, 80, top + 23, 25, to_rgb8(shade(color, 0.8)))
    _biscuits(draw, rng, int(rng.integers(95, 120)))
    side = Image.new("RGB", (60, 210), to_rgb8(shade(color, 0.92)))
    sides = ImageDraw.Draw(side)
    sides.rectangle((8, 60, 52, 190), fill=to_rgb8(band))
    for row in range(72, 184, 9):
        sides.line((13, row, int(rng.integers(30, 48)), row), fill=(60, 50, 45), width=2)
    return front, side, Image.new("RGB", (60, 160), to_rgb8(shade(color, 0.95)))


def _biscuits(draw: ImageDraw.ImageDraw, rng: Generator, top: int) -> None:
    """A heap of square or round crackers on the lower part of the front."""
    round_ = rng.random() < 0.4
    for row in range(3):
        for column in range(4):
            x = 14 + column * 34 + int(rng.integers(-5, 6)) + 10 * (row % 2)
            y = top + row * 27 + int(rng.integers(-4, 5))
            tone = to_rgb8(shade(BISCUIT, rng.uniform(0.8, 1.1)))
            corners = (x, y, x + 30, y + 30)
            (draw.ellipse if round_ else draw.rectangle)(corners, tone, (150, 100, 40))
            for dot in (8, 15, 22):
                draw.point([(x + dot, y + 8), (x + dot, y + 15), (x + dot, y + 22)], (110, 70, 30))


def _centred(
    draw: ImageDraw.ImageDraw, text: str, x: int, y: int, size: int, fill: tuple[int, int, int]
) -> None:
    draw.text((x, y), text, fill=fill, font=ImageFont.load_default(size), anchor="mm")


def make_mustard_bottle(rng: Generator) -> Asset:
    """A flat squeeze bottle of 0.17 to 0.21 m with a pointed cap, label towards +x and -x."""
    scale, flat = rng.uniform(0.92, 1.1), rng.uniform(0.58, 0.72)
    yellow = pick(rng, MUSTARD, 0.015)
    round_ = [(0.0, 0.001), (0.043, 0.0), (0.047, 0.008), (0.047, 0.05), (0.045, 0.095),
              (0.043, 0.115), (0.034, 0.136), (0.019, 0.150), (0.017, 0.153)]  # fmt: skip
    body = lathe(np.array(round_) * scale, 24).scaled((flat, 1, 1))
    nozzle = [(0.019, 0.150), (0.019, 0.164), (0.012, 0.170), (0.0055, 0.190), (0.0, 0.191)]
    cap = pick(rng, [yellow, (0.78, 0.10, 0.07), (0.95, 0.95, 0.92), (0.10, 0.35, 0.15)], 0.02)
    top = lathe(np.array(nozzle) * scale, 14)
    label = _label(rng, yellow)
    parts = [Part(_upright(body), texture=label, roughness=0.4), Part(top, cap, roughness=0.4)]
    half = 0.047 * scale
    low, high = (-half * flat, -half, 0.0), (half * flat, half, 0.15 * scale)
    neck = box_shape((-0.019, -0.019, 0.15 * scale), (0.019, 0.019, 0.18 * scale))
    return assemble("mustard bottle", parts, [box_shape(low, high), neck])


def _upright(surface: Surface) -> Surface:
    """The surface with v proportional to height instead of the way along the profile."""
    height = surface.vertices[:, 2]
    v = 1 - (height - height.min()) / np.ptp(height)
    return Surface(surface.vertices, surface.triangles, np.column_stack([surface.uvs[:, 0], v]))


def _label(rng: Generator, yellow: Color) -> Texture:
    """Once around the bottle, twice the same; u = 0 and 1/2 look along x."""
    paper = pick(rng, [CREAM, (0.96, 0.95, 0.92), shade(yellow, 1.12)], 0.02)
    ink = pick(rng, [(0.70, 0.10, 0.07), (0.10, 0.30, 0.15), (0.12, 0.15, 0.40)], 0.03)
    low = rng.uniform(0.16, 0.24)
    image = Image.fromarray(bands(yellow, [(low, 0.62, paper)], 128)).resize((256, 128))
    draw = ImageDraw.Draw(image)
    middle = int(128 * (1 - (low + 0.62) / 2))
    for x in (0, 128, 256):
        draw.ellipse((x - 30, middle - 17, x + 30, middle + 17), fill=to_rgb8(ink))
        _centred(draw, "MUSTARD", x, middle, 12, (250, 245, 225))
    return from_image(image)
