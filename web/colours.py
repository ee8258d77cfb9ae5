"""Colours as the page needs them; those of classes are in `robots.colours`."""

import numpy as np

from robots.colours import Rgb
from schemas.arrays import Bytes, Floats

_viridis = np.array(
    [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]], np.float64
)
"""Five anchors of the map; between them it is close to linear."""


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
