"""Things whose place is known: pictures with the truth in space, rendered as a robot sees them.

The base frame is level with the ground under the camera; depth has the noise of the sensor, and
boxes are as inexact as those of a detector.
"""

import math
from collections.abc import Iterator

import numpy as np
from numpy.random import Generator

from schemas.arrays import Floats
from schemas.geometry import Pose2, Pose3
from services.perception.space.rays import camera_rays, depth_metres
from services.perception.space.surface import surface_in
from services.perception.training.forms.fit import Example
from sim.annotation import TrueFrame
from sim.assets.library import DETECTED
from sim.sensors import measured_depth

range_max = 7.0
"""Farther things are not placed [m]."""
_box_noise = 0.02
"""Deviation of a detector's box edges, in sides."""


def examples_in(truth: TrueFrame, rng: Generator) -> Iterator[Example]:
    """One for every labelled object of the picture that has a surface to be seen."""
    base_from_camera = level_from(truth.world_from_camera)
    rays = camera_rays(truth.intrinsics, base_from_camera)
    depth = depth_metres(measured_depth(truth.depth, range_max, rng))
    for row in np.flatnonzero(~truth.frame.ignored).tolist():
        box = _as_detected(truth.frame.boxes[row].astype(np.float64), rng)
        surface = surface_in(box, depth, rays, truth.intrinsics, range_max)
        if surface is not None:
            corners = base_from_camera.apply(corners_of(truth, row))
            center, size, yaw = upright_box(corners)
            label = DETECTED[int(truth.frame.classes[row])]
            yield Example(label, surface, center, size, yaw)


def level_from(world_from_camera: Pose3) -> Pose3:
    """Pose of the camera in a base frame that stands upright below it and looks as it does."""
    ahead = world_from_camera.rotation()[:, 2]
    x, y, _ = world_from_camera.position
    base = Pose2(x, y, math.atan2(ahead[1], ahead[0])).lifted()
    return base.inverse() @ world_from_camera


def corners_of(truth: TrueFrame, row: int) -> Floats:
    """Corners (8, 3) of the box around an object, camera frame [m]."""
    signs = np.stack(np.meshgrid(*[(-0.5, 0.5)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return truth.centers[row] + (signs * truth.sizes[row]) @ truth.rotations[row].T


def upright_box(corners: Floats) -> tuple[Floats, Floats, float]:
    """Centre (3,), size (3,) length >= width, and height, and yaw of the least upright box."""
    low, high = corners[:, 2].min(), corners[:, 2].max()
    edges = (corners[:, None, :2] - corners[None, :, :2]).reshape(-1, 2)
    edges = edges[np.hypot(*edges.T) > 1e-6]
    yaws = np.arctan2(edges[:, 1], edges[:, 0])
    turned = np.stack([np.cos(yaws), np.sin(yaws), -np.sin(yaws), np.cos(yaws)], axis=-1)
    along = np.einsum("yij,cj->yci", turned.reshape(-1, 2, 2), corners[:, :2])
    least, most = along.min(axis=1), along.max(axis=1)
    best = int(np.argmin((most - least).prod(axis=1)))
    yaw, size, middle = float(yaws[best]), most[best] - least[best], (least[best] + most[best]) / 2
    center = turned[best].reshape(2, 2).T @ middle
    if size[0] < size[1]:
        yaw, size = yaw + math.pi / 2, size[::-1]
    yaw = (yaw + math.pi / 2) % math.pi - math.pi / 2
    return np.array([*center, (low + high) / 2]), np.array([*size, high - low]), yaw


def _as_detected(box: Floats, rng: Generator) -> Floats:
    sides = np.tile(box[2:] - box[:2], 2)
    return box + _box_noise * sides * rng.normal(size=4)
