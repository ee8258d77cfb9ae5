"""Seamless textures as uint8 arrays (height, width, 3), drawn with numpy and Pillow."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from PIL import Image, ImageDraw

Color = tuple[float, float, float]
"""Red, green, blue in [0, 1]."""
Texture = NDArray[np.uint8]


def hsv(hue: float, saturation: float, value: float) -> Color:
    """Colour from hue, saturation and value in [0, 1]; the hue wraps around."""
    return colorsys.hsv_to_rgb(hue % 1.0, saturation, value)


def pick(rng: Generator, colors: Sequence[Color], spread: float = 0.05) -> Color:
    """One of the colours, each channel shaken by a normal of the given spread."""
    base = np.asarray(colors[int(rng.integers(len(colors)))]) + rng.normal(0, spread, 3)
    red, green, blue = np.clip(base, 0.02, 1.0)
    return float(red), float(green), float(blue)


def shade(color: Color, factor: float) -> Color:
    """The colour made lighter (factor > 1) or darker, clipped to [0, 1]."""
    red, green, blue = (min(1.0, channel * factor) for channel in color)
    return red, green, blue


def to_rgb8(color: Color) -> tuple[int, int, int]:
    """The colour as three integers in [0, 255]."""
    red, green, blue = (round(255 * channel) for channel in color)
    return red, green, blue


def fractal(rng: Generator, size: int, roughness: float) -> NDArray[np.float64]:
    """Periodic noise (size, size), mean 0, deviation 1, with amplitude 1 / frequency^roughness."""
    frequency = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)[None, :]) * size
    amplitude = np.where(frequency > 0, 1 / np.maximum(frequency, 1) ** roughness, 0)
    spectrum = np.fft.rfft2(rng.normal(size=(size, size))) * amplitude
    field = np.fft.irfft2(spectrum, s=(size, size))
    return field / field.std()


def mottled(
    rng: Generator, color: Color, contrast: float = 0.08, size: int = 64, roughness: float = 1.0
) -> Texture:
    """A colour with seamless light and dark patches; `contrast` is their relative deviation."""
    light = 1 + contrast * fractal(rng, size, roughness)
    return _quantised(light[..., None] * np.asarray(color))


def _quantised(image: NDArray[np.float64]) -> Texture:
    return (np.clip(image, 0, 1) * 255).astype(np.uint8)


def mixed(weight: NDArray[np.float64], low: Color, high: Color) -> Texture:
    """Blend of two colours by a weight image (h, w), 0 giving `low` and 1 giving `high`."""
    clipped = np.clip(weight, 0, 1)[..., None]
    return _quantised(clipped * np.asarray(high) + (1 - clipped) * np.asarray(low))


def bands(color: Color, stripes: Sequence[tuple[float, float, Color]], rows: int = 128) -> Texture:
    """Horizontal bands over a colour; each stripe is (low, high, colour), 0 bottom and 1 top."""
    image = np.tile(np.asarray(color), (rows, 8, 1))
    height = 1 - (np.arange(rows) + 0.5) / rows
    for low, high, stripe in stripes:
        image[(height >= low) & (height < high)] = stripe
    return _quantised(image)


def bricks(
    rng: Generator, brick: Color, mortar: Color, courses: int = 16, size: int = 128
) -> Texture:
    """Running-bond brickwork with `courses` rows (even, so that it tiles)."""
    step = size // courses
    row = np.arange(size) // step
    shift = (row % 2) * step
    column = ((np.arange(size)[None, :] + shift[:, None]) % size) // (2 * step)
    tone = 1 + 0.12 * rng.normal(size=(courses, courses))[row[:, None], column]
    image = (tone + 0.05 * fractal(rng, size, 0.5))[..., None] * np.asarray(brick)
    joint = (np.arange(size)[:, None] % step == 0) | (
        (np.arange(size)[None, :] + shift[:, None]) % (2 * step) == 0
    )
    image[joint] = mortar
    return _quantised(image)


def canvas(color: Color, width: int, height: int) -> tuple[Image.Image, ImageDraw.ImageDraw]:
    """A plain Pillow picture and something to draw on it with."""
    image = Image.new("RGB", (width, height), to_rgb8(color))
    return image, ImageDraw.Draw(image)


def from_image(image: Image.Image) -> Texture:
    """The picture's pixels as an array."""
    return np.asarray(image.convert("RGB"), np.uint8)
