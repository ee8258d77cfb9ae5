"""A pinhole camera in a scene: colour with sky, depth and segmentation."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import sapien
from numpy.typing import NDArray
from sapien import render

from schemas.geometry import Pose3
from schemas.sensing import Intrinsics
from sim.rendering.bodies import entity
from sim.rendering.shader import lit_shader_dir
from sim.rendering.sky import paint_sky

NEAR, FAR = 0.05, 150.0
"""Clipping distances [m]."""
LEVEL_FROM_OPTICAL = Pose3((0.0, 0.0, 0.0), (0.5, -0.5, 0.5, -0.5))
"""SAPIEN's cameras look along +x with +z up; ours along +z with +y down."""


@dataclass(frozen=True)
class Picture:
    """One exposure."""

    color: NDArray[np.uint8]
    """(H, W, 3) RGB."""
    depth: NDArray[np.float32]
    """(H, W) along the optical axis [m]; 0 where there is only sky."""
    entities: NDArray[np.uint32]
    """(H, W) `per_scene_id` of the entity seen, 0 for the sky."""


def intrinsics(width: int, height: int, horizontal_fov: float) -> Intrinsics:
    """Square pixels with the principal point in the middle of the picture; the angle is in rad."""
    focal = width / 2 / math.tan(horizontal_fov / 2)
    return Intrinsics(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)


class Camera:
    """A camera that is moved by hand and rendered on demand."""

    def __init__(self, scene: sapien.Scene, width: int, height: int, horizontal_fov: float) -> None:
        self._scene = scene
        self.intrinsics = intrinsics(width, height, horizontal_fov)
        self._camera = render.RenderCameraComponent(width, height, lit_shader_dir())
        self._camera.set_fovy(2 * math.atan(height / 2 / self.intrinsics.fy))
        self._camera.near, self._camera.far = NEAR, FAR
        self._entity = entity(self._camera)
        self._entity.add_to_scene(scene)

    def picture(self, world_from_camera: Pose3, sky_seed: int = 0) -> Picture:
        """Render from a pose whose axes are x right, y down, z forward."""
        level = world_from_camera @ LEVEL_FROM_OPTICAL.inverse()
        self._entity.set_pose(sapien.Pose(list(level.position), list(level.wxyz)))
        self._scene.update_render()
        self._camera.take_picture()
        entities = np.asarray(self._camera.get_picture("Segmentation"))[..., 1]
        depth = -np.asarray(self._camera.get_picture("Position"))[..., 2]
        color = np.asarray(self._camera.get_picture("Color"))[..., :3]
        painted = (np.clip(color, 0, 1) * 255 + 0.5).astype(np.uint8)
        paint_sky(painted, entities == 0, self.intrinsics, world_from_camera, sky_seed)
        return Picture(painted, np.where(entities == 0, 0, depth).astype(np.float32), entities)
