"""What a real camera adds to a picture: exposure, white balance, blur, noise, compression."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Pixels = NDArray[np.float32]

MIDDLE_GREY = 0.42


def exposed(color: NDArray[np.uint8], rng: Generator) -> NDArray[np.uint8]:
    """The picture (H, W, 3) as some camera with some settings would have sent it."""
    light = _developed(color.astype(np.float32), rng)
    light = _noisy(_blurred(_vignetted(light, rng), rng), rng)
    return _compressed((np.clip(light, 0, 1) * 255 + 0.5).astype(np.uint8), rng)


def _developed(light: Pixels, rng: Generator) -> Pixels:
    """Values of 0 to 255 as light of 0 to 1, exposed half-way towards a middle grey, and tinted.

    Lamps are warm, shade is cold, and cameras correct that in part.
    """
    automatic = (MIDDLE_GREY / max(float(light.mean()) / 255, 0.02)) ** 0.5
    misjudged = 2 ** float(np.clip(rng.normal(0, 0.25), -0.6, 0.5))
    exposure = float(np.clip(automatic, 0.75, 2.2)) * misjudged
    warmth = float(np.clip(rng.normal(0.02, 0.07), -0.16, 0.22))
    tint = np.array([1 + warmth, 1 + rng.normal(0, 0.02), 1 - warmth], np.float32)
    return (light * tint * np.float32(exposure / 255)).astype(np.float32)


def _vignetted(light: Pixels, rng: Generator) -> Pixels:
    """Darker corners, in half of the pictures."""
    if rng.random() < 0.5:
        return light
    height, width = light.shape[:2]
    y = np.linspace(-0.75, 0.75, height, dtype=np.float32)[:, None]
    x = np.linspace(-1, 1, width, dtype=np.float32)[None]
    fall = np.float32(rng.uniform(0.05, 0.3)) * (x**2 + y**2)
    return (light * (1 - fall)[..., None]).astype(np.float32)


def _blurred(light: Pixels, rng: Generator) -> Pixels:
    """Slightly out of focus, in a third of the pictures."""
    if rng.random() < 0.65:
        return light
    return np.asarray(cv2.GaussianBlur(light, (5, 5), rng.uniform(0.3, 0.9)), np.float32)


def _noisy(light: Pixels, rng: Generator) -> Pixels:
    """Shot noise, whose variance grows with the light, and noise of the electronics."""
    shot, read = rng.uniform(0, 0.03) ** 2, rng.uniform(0.002, 0.02) ** 2
    deviation = np.sqrt(np.maximum(light, 0) * np.float32(shot) + np.float32(read))
    return light + deviation * rng.standard_normal(light.shape, np.float32)


def _compressed(color: NDArray[np.uint8], rng: Generator) -> NDArray[np.uint8]:
    quality = int(rng.integers(60, 97))
    packed = cv2.imencode(".jpg", color, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return np.asarray(cv2.imdecode(packed, cv2.IMREAD_UNCHANGED), np.uint8)
