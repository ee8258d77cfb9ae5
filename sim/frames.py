"""Renders and labels training frames. Import it after `sim.vulkan.activate()`."""

from __future__ import annotations

import numpy as np
import sapien
from numpy.typing import NDArray
from sapien import render

from robots.husky.spec import HUSKY
from schemas.geometry import Pose3
from sim.annotation import TrainingFrame, visible_box
from sim.assets.library import DETECTED, make_asset
from sim.rendering.camera import Camera
from sim.rendering.stage import Stage
from sim.scenes.model import PlacedObject
from sim.scenes.training import random_scene, random_view

FRAMES_PER_SCENE = 6


class FrameRenderer:
    """Renders random scenes one after another in one SAPIEN scene."""

    def __init__(self) -> None:
        self._scene = sapien.Scene([render.RenderSystem()])
        spec = HUSKY.camera
        self._camera = Camera(self._scene, spec.width, spec.height, spec.horizontal_fov)

    def frames(self, seed: int, scene: int) -> list[TrainingFrame]:
        """The pictures of one scene of a seed; the same arrays on every call."""
        rng = np.random.default_rng([seed, scene])
        world = random_scene(rng)
        stage = Stage(self._scene, world.ground, world.sun)
        numbered = {stage.put(placed): placed for placed in world.objects}
        sky = int(rng.integers(1000))
        views = [random_view(rng, world) for _ in range(FRAMES_PER_SCENE)]
        frames = [self._frame(view, numbered, sky) for view in views]
        stage.strike()
        return frames

    def _frame(self, view: Pose3, numbered: dict[int, PlacedObject], sky: int) -> TrainingFrame:
        picture = self._camera.picture(view, sky)
        found: list[tuple[NDArray[np.float32], int]] = []
        for number, placed in numbered.items():
            if placed.label in DETECTED:
                whole = self._unoccluded_area(view, placed)
                box = visible_box(picture.entities == number, whole)
                found += [] if box is None else [(box, DETECTED.index(placed.label))]
        boxes = np.array([box for box, _ in found], np.float32).reshape(-1, 4)
        return TrainingFrame(picture.color, boxes, np.array([c for _, c in found], np.int64))

    def _unoccluded_area(self, view: Pose3, placed: PlacedObject) -> float:
        """Area [px^2] of the box around all of the object's points, within the picture."""
        camera = self._camera.intrinsics
        asset = make_asset(placed.label, placed.look)
        points = np.concatenate([mesh.vertices for mesh in asset.meshes]) * placed.scale
        seen = view.inverse().apply(placed.world_from_object.lifted().apply(points))
        depth = np.maximum(seen[:, 2], 0.05)
        u = np.clip(camera.fx * seen[:, 0] / depth + camera.cx, 0, camera.width)
        v = np.clip(camera.fy * seen[:, 1] / depth + camera.cy, 0, camera.height)
        return float(np.ptp(u) * np.ptp(v))
