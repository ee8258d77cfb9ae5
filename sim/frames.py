"""Renders and labels training frames. Import it after `sim.vulkan.activate()`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import sapien
from numpy.random import Generator
from numpy.typing import NDArray
from sapien import render

from sim.annotation import (
    TrainingFrame,
    TrueFrame,
    is_ignored,
    visible_box,
    visible_share,
)
from sim.assets.library import DETECTED
from sim.rendering.camera import Camera, Picture
from sim.rendering.exposure import exposed
from sim.rendering.stage import Stage
from sim.scenes.training import random_scene
from sim.scenes.training_model import Item, TrainingScene
from sim.scenes.training_parts import Part
from sim.scenes.training_views import (
    FRAMES_PER_SCENE,
    HEIGHT,
    MOUNTS,
    WIDTH,
    View,
    random_view,
)

LEAST_SLOPE = 0.08
"""Of the line from the rim of an open box up to the camera."""


@dataclass(frozen=True)
class _Seen:
    """One object of the classes that shows in a picture."""

    item: Item
    box: NDArray[np.float32]
    visible: float
    ignored: bool


@dataclass(frozen=True)
class _Shot:
    """One picture as the renderer made it, and what shows in it."""

    view: View
    picture: Picture
    camera: Camera
    seen: list[_Seen]


class FrameRenderer:
    """Renders random scenes one after another in one SAPIEN scene."""

    def __init__(self) -> None:
        self._scene = sapien.Scene([render.RenderSystem()])
        angles = {mount.horizontal_fov for mount in MOUNTS}
        self._cameras = {fov: Camera(self._scene, WIDTH, HEIGHT, fov) for fov in angles}

    def frames(self, part: Part, seed: int, scene: int) -> list[TrainingFrame]:
        """The pictures of one scene of a set; the same arrays on every call."""
        world, rng = random_scene(part, seed, scene)
        return [_frame(shot, rng) for shot in self._shots(world, rng)]

    def true_frames(self, part: Part, seed: int, scene: int) -> list[TrueFrame]:
        """The same pictures with depth and the truth in space, for the 3-D benchmark."""
        world, rng = random_scene(part, seed, scene)
        return [_true_frame(shot, rng) for shot in self._shots(world, rng)]

    def _shots(self, world: TrainingScene, rng: Generator) -> Iterator[_Shot]:
        stage = Stage(self._scene, world.floor, world.sun)
        numbered = {_put(stage, item): item for item in world.items}
        for _ in range(FRAMES_PER_SCENE):
            view = random_view(rng, world)
            camera = self._cameras[view.mount.horizontal_fov]
            picture = camera.picture(view.world_from_camera, world.sky)
            yield _Shot(view, picture, camera, _objects(view, picture, camera, numbered))
        stage.strike()


def _put(stage: Stage, item: Item) -> int:
    if item.support.shaded:
        on = item.support
        stage.shade(item.asset, item.world_from_object, on.covering, on.height)
    return stage.show(item.asset, item.world_from_object)


def _objects(
    view: View, picture: Picture, camera: Camera, numbered: dict[int, Item]
) -> list[_Seen]:
    """What shows of the classes, however little of it."""
    found: list[_Seen] = []
    for number in np.unique(picture.entities).tolist():
        item = numbered.get(number)
        if item is None or item.label not in DETECTED:
            continue
        mask = picture.entities == number
        box = visible_box(mask)
        assert box is not None
        pose = view.world_from_camera.inverse() @ item.world_from_object
        share = visible_share(mask, item.asset, pose, camera.intrinsics)
        ignored = is_ignored(box, share) or not _is_open_to(item, view)
        found.append(_Seen(item, box, share, ignored))
    return found


def _is_open_to(item: Item, view: View) -> bool:
    """Whether an open box is seen from so far above its rim that it looks open; others always are.

    From the side nobody can tell it from a closed one.
    """
    if item.label != "box":
        return True
    x, y, z = item.world_from_object.position
    rim = z + max(shape.center[2] + shape.half[2] for shape in item.asset.collisions)
    eye = view.world_from_camera.position
    return eye[2] - rim > LEAST_SLOPE * math.hypot(eye[0] - x, eye[1] - y)


def _frame(shot: _Shot, rng: Generator) -> TrainingFrame:
    seen = shot.seen
    return TrainingFrame(
        color=exposed(shot.picture.color, rng),
        boxes=np.array([one.box for one in seen], np.float32).reshape(-1, 4),
        classes=np.array([DETECTED.index(one.item.label) for one in seen], np.int64),
        ignored=np.array([one.ignored for one in seen], np.bool_),
        visible=np.array([one.visible for one in seen], np.float32),
    )


def _true_frame(shot: _Shot, rng: Generator) -> TrueFrame:
    camera_from_world = shot.view.world_from_camera.inverse()
    items = [one.item for one in shot.seen]
    turns = [(camera_from_world @ item.world_from_object).rotation() for item in items]
    centers = np.array([item.center for item in items]).reshape(-1, 3)
    return TrueFrame(
        frame=_frame(shot, rng),
        depth=shot.picture.depth,
        intrinsics=shot.camera.intrinsics,
        world_from_camera=shot.view.world_from_camera,
        centers=camera_from_world.apply(centers),
        rotations=np.array(turns).reshape(-1, 3, 3),
        sizes=np.array([item.asset.size for item in items]).reshape(-1, 3),
    )
