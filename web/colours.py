"""Colours: one of Okabe and Ito's for each class, so that colour-blind eyes tell them apart."""

import zlib

import numpy as np

from schemas.arrays import Bytes, Floats

Rgb = tuple[int, int, int]

ORANGE: Rgb = (230, 159, 0)
SKY: Rgb = (86, 180, 233)
GREEN: Rgb = (0, 158, 115)
BLUE: Rgb = (0, 114, 178)
VERMILLION: Rgb = (213, 94, 0)
PURPLE: Rgb = (204, 121, 167)
GREY: Rgb = (110, 116, 128)

_class_colours: dict[str, Rgb] = {
    "hydrant": VERMILLION,
    "cone": ORANGE,
    "barrel": BLUE,
    "tree": GREEN,
    "car": PURPLE,
    "building": SKY,
    "wall": GREY,
    "robot": GREY,
    "unknown": GREY,
}
_cycle = (ORANGE, SKY, GREEN, BLUE, VERMILLION, PURPLE)

_viridis = np.array(
    [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]], np.float64
)
"""Five anchors of the map; between them it is close to linear."""


def class_colour(name: str) -> Rgb:
    """Colour of an object class; the same on every page and in every run."""
    return _class_colours.get(name) or _cycle[zlib.crc32(name.encode()) % len(_cycle)]


def css(colour: Rgb) -> str:
    """The colour as a stylesheet writes it."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def linear(colours: Bytes | Rgb) -> Bytes:
    """SRGB to linear bytes.

    viser 1.1.1 takes `batched_colors` for linear light where all its other colours are sRGB:
    without this the instances come out pale.
    """
    c = np.asarray(colours, np.float64) / 255
    light = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    return np.round(255 * light).astype(np.uint8)


def cost_colours(costs: Floats) -> Bytes:
    """Colours (K, 3) of costs (K,): yellow is the cheapest, violet the dearest."""
    span = np.ptp(costs) if len(costs) else 0.0
    cheapness = 1.0 - (costs - costs.min()) / span if span > 0 else np.ones(len(costs))
    stops = np.linspace(0.0, 1.0, len(_viridis))
    channels = [np.interp(cheapness, stops, _viridis[:, k]) for k in range(3)]
    return np.stack(channels, axis=-1).round().astype(np.uint8)
