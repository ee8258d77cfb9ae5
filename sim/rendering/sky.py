"""The sky: a gradient from haze to blue with soft clouds, painted where nothing was drawn."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from schemas.geometry import Pose3
from schemas.sensing import Intrinsics
from sim.assets.texture import fractal

ROWS, COLUMNS = 256, 512


@lru_cache(maxsize=8)
def sky_panorama(seed: int) -> NDArray[np.uint8]:
    """Colours (256, 512, 3): rows from the zenith to the horizon, columns once around."""
    rng = np.random.default_rng([seed, 7])
    zenith = np.array([0.25, 0.48, 0.85]) + rng.normal(0, 0.05, 3)
    haze = np.array([0.78, 0.86, 0.93]) + rng.normal(0, 0.04, 3)
    overcast = rng.uniform(0, 1) ** 2
    height = (1 - np.arange(ROWS) / (ROWS - 1))[:, None, None]
    clear = haze + (zenith - haze) * height**0.55
    clouds = np.tile(fractal(rng, ROWS, 1.5), (1, COLUMNS // ROWS))[..., None]
    weight = np.clip(0.35 * (clouds - 0.8 + 1.8 * overcast), 0, 0.95)
    grey = np.array([0.86, 0.87, 0.89]) * (1 - 0.18 * overcast)
    return (np.clip(clear + (grey - clear) * weight, 0, 1) * 255).astype(np.uint8)


@lru_cache(maxsize=4)
def _rays(camera: Intrinsics) -> NDArray[np.float64]:
    """Unnormalised direction of every pixel (H, W, 3) in the camera frame."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = np.ones((camera.height, camera.width, 3))
    rays[..., 0], rays[..., 1] = (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy
    return rays


def paint_sky(
    color: NDArray[np.uint8],
    empty: NDArray[np.bool_],
    camera: Intrinsics,
    world_from_camera: Pose3,
    seed: int,
) -> None:
    """Colour the empty pixels of a picture in place."""
    rays = _rays(camera)[empty] @ world_from_camera.rotation().T
    azimuth = np.arctan2(rays[:, 1], rays[:, 0]) / (2 * np.pi)
    elevation = np.clip(rays[:, 2] / np.linalg.norm(rays, axis=1), 0, 1)
    row = ((1 - elevation) * (ROWS - 1)).astype(np.int64)
    column = (azimuth * COLUMNS).astype(np.int64) % COLUMNS
    color[empty] = sky_panorama(seed)[row, column]
