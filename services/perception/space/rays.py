"""Where each pixel of a camera looks, in the base frame."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from schemas.arrays import Floats, Words
from schemas.geometry import Pose3
from schemas.sensing import Intrinsics


@dataclass(frozen=True)
class CameraRays:
    """A camera's rays and where they meet the ground, taken as flat."""

    origin: Floats
    """(3,) camera position in the base frame [m]."""
    directions: Floats
    """(H, W, 3) in the base frame, of length one along the optical axis."""
    ground: Floats
    """(H, W, 2) x, y in the base frame [m]; infinite at and above the horizon."""

    def points(self, depth: Floats) -> Floats:
        """Points (H, W, 3) in the base frame of a depth image (H, W) [m]."""
        return self.origin + self.directions * depth[..., None]


@lru_cache(maxsize=8)
def camera_rays(intrinsics: Intrinsics, base_from_camera: Pose3) -> CameraRays:
    """Rays of all pixels; cached, since a camera that is fixed to the base asks once."""
    u, v = np.meshgrid(np.arange(intrinsics.width), np.arange(intrinsics.height))
    x, y = (u - intrinsics.cx) / intrinsics.fx, (v - intrinsics.cy) / intrinsics.fy
    optical = np.stack([x, y, np.ones_like(x)], axis=-1)
    directions = optical @ base_from_camera.rotation().T
    origin = np.array(base_from_camera.position)
    down = -directions[..., 2]
    depth = np.divide(origin[2], down, out=np.full_like(down, np.inf), where=down > 1e-6)
    finite = np.isfinite(depth)[..., None]
    with np.errstate(invalid="ignore"):
        ground = np.where(finite, origin[:2] + directions[..., :2] * depth[..., None], np.inf)
    return CameraRays(origin, directions, ground)


def depth_metres(depth_mm: Words) -> Floats:
    """Depth image [m]; 0 where nothing was measured."""
    return depth_mm.astype(np.float64) / 1000.0


def axial_noise(depth: Floats | float) -> Floats:
    """Standard deviation of a depth reading [m].

    Grows with the square of the distance, as of any stereo or structured-light camera (model and
    figures: Nguyen, Izadi & Lovell, 2012, for a Kinect).
    """
    return np.asarray(0.001 + 0.0019 * (np.asarray(depth) - 0.4) ** 2)
