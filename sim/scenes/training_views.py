"""Where the camera of a training picture is: on a mast, on a wheelchair or on an arm."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from robots.husky.spec import HUSKY
from robots.wheelchair.spec import WHEELCHAIR
from schemas.geometry import Pose3, Quaternion, quaternion_product
from sim.assets.library import DETECTED
from sim.scenes.training_model import Item, TrainingScene

FRAMES_PER_SCENE = 6
WIDTH, HEIGHT = HUSKY.camera.width, HUSKY.camera.height


@dataclass(frozen=True)
class Mount:
    """A way in which robots carry a camera."""

    horizontal_fov: float
    """[rad]"""
    height: float
    """Above the ground [m]."""
    pitch: float
    """Down from level [rad]."""


HUSKY_MAST = Mount(
    HUSKY.camera.horizontal_fov, HUSKY.camera.base_from_camera.position[2], math.radians(8.0)
)
# A third of its wide picture; the scale is that of the whole.
WHEELCHAIR_MOUNT = Mount(math.radians(60.0), WHEELCHAIR.camera.base_from_camera.position[2], 0.0)
ARM = Mount(math.radians(60.0), 0.0, 0.0)
"""Height and pitch are the arm's to choose."""
MOUNTS = (HUSKY_MAST, WHEELCHAIR_MOUNT, ARM)

FARTHEST, FARTHEST_SMALL = 12.0, 4.5
"""Greatest distance of what a picture is taken of, and of things less than `SMALL_SIZE` [m]."""
SMALL_SIZE = 0.35
FAR_SIZES = 20.0
"""Nor is it farther than this many times its longest side, about twelve pixels."""
CLEARANCE = 0.2
"""Between the camera and anything else [m]."""
_optical_from_level = (0.5, -0.5, 0.5, -0.5)
_tries = 80


@dataclass(frozen=True)
class View:
    """Which camera, and where it is."""

    mount: Mount
    world_from_camera: Pose3


def random_view(rng: Generator, scene: TrainingScene) -> View:
    """A view of something: a class drawn first, so that rare ones are seen as often."""
    candidates = _interesting(scene)
    for _ in range(_tries):
        labels = sorted({item.label for item in candidates})
        label = labels[int(rng.integers(len(labels)))]
        alike = [item for item in candidates if item.label == label]
        view = _view_of(rng, alike[int(rng.integers(len(alike)))])
        if _is_clear(scene, view.world_from_camera):
            return view
    # Nothing can be approached: from above the middle, somewhere.
    return View(ARM, _looking((0.0, 0.0, 1.5), rng.uniform(-math.pi, math.pi), 0.5, 0.0))


def _interesting(scene: TrainingScene) -> list[Item]:
    """Labelled things if there are any, else whatever stands or lies about."""
    labelled = [item for item in scene.items if item.label in DETECTED]
    return labelled or [item for item in scene.items if item.label != "room"]


def _view_of(rng: Generator, target: Item) -> View:
    far = FARTHEST_SMALL if target.longest < SMALL_SIZE else FARTHEST
    far = min(far, FAR_SIZES * target.longest)
    drawn = rng.random()
    if far < 1.6 or (drawn < 0.45 and target.longest < 1.0):
        return _from_arm(rng, target, far)
    mount = HUSKY_MAST if drawn < 0.75 else WHEELCHAIR_MOUNT
    return _from_mast(rng, target, mount, far)


def _from_mast(rng: Generator, target: Item, mount: Mount, far: float) -> View:
    """Upright on its robot; the target is near the middle, or to a side, or out of view."""
    height = mount.height + rng.normal(0, 0.06)
    pitch = mount.pitch + rng.normal(0, 0.06)
    # Nearer than this the target is below the picture.
    lowest = pitch + 0.8 * math.atan(math.tan(mount.horizontal_fov / 2) * HEIGHT / WIDTH)
    drop = max(0.0, height - target.top)
    near = max(target.radius + 0.45, drop / math.tan(max(lowest, 0.2)))
    distance = math.exp(rng.uniform(math.log(near), math.log(max(far, near * 1.3))))
    bearing = rng.uniform(-math.pi, math.pi)
    x, y = (target.center[:2] + distance * _level(bearing)).tolist()
    off = rng.uniform(-math.pi, math.pi) if rng.random() < 0.06 else rng.normal(0, 0.28)
    place = (x, y, height)
    return View(mount, _looking(place, bearing + math.pi + off, pitch, rng.normal(0, 0.02)))


def _from_arm(rng: Generator, target: Item, far: float) -> View:
    """Free in space, looking at the target from above or from the side."""
    inside = not target.support.shaded
    elevation = rng.uniform(0.75, 1.5) if inside else rng.uniform(0.12, 1.4)
    near = max(0.4, 1.1 * target.longest)
    distance = math.exp(rng.uniform(math.log(near), math.log(max(min(far, 2.5), near * 1.4))))
    bearing = rng.uniform(-math.pi, math.pi)
    away = np.append(math.cos(elevation) * _level(bearing), math.sin(elevation))
    x, y, z = (target.center + distance * away).tolist()
    off = rng.normal(0, 0.16, 2)
    yaw, pitch = bearing + math.pi + off[0] / max(math.cos(elevation), 0.3), elevation + off[1]
    return View(ARM, _looking((x, y, max(z, 0.25)), float(yaw), float(pitch), rng.normal(0, 0.1)))


def _level(bearing: float) -> np.ndarray:
    return np.array([math.cos(bearing), math.sin(bearing)])


def _looking(place: tuple[float, float, float], yaw: float, pitch: float, roll: float) -> Pose3:
    """Optical axes (x right, y down, z forward) at a place, pitched down from level."""
    turn = quaternion_product(_half_turn(3, yaw), _half_turn(2, pitch))
    turn = quaternion_product(turn, _half_turn(1, roll))
    return Pose3(place, quaternion_product(turn, _optical_from_level))


def _half_turn(axis: int, angle: float) -> Quaternion:
    wxyz = [math.cos(angle / 2), 0.0, 0.0, 0.0]
    wxyz[axis] = math.sin(angle / 2)
    return wxyz[0], wxyz[1], wxyz[2], wxyz[3]


def _is_clear(scene: TrainingScene, world_from_camera: Pose3) -> bool:
    """Whether the camera is in the room and in nothing else."""
    x, y, z = world_from_camera.position
    if scene.room is not None:
        length, width, height = scene.room
        if abs(x) > length / 2 - 0.25 or abs(y) > width / 2 - 0.25 or z > height - 0.2:
            return False
    return all(_is_outside(item, x, y, z) for item in scene.items if item.label != "room")


def _is_outside(item: Item, x: float, y: float, z: float) -> bool:
    apart = math.hypot(x - item.center[0], y - item.center[1])
    return apart > item.radius + CLEARANCE or z > item.top + CLEARANCE
