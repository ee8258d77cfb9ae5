"""Postures from which the camera on the wrist sees into a box."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robots.arm import ArmSpec, WristCamera
from robots.arm_kinematics import inverse_of, matrix
from robots.spec import RobotSpec
from schemas.arrays import Flags, Floats
from schemas.task import HandlingFailure
from services.manipulation.collision import ArmCollision
from services.manipulation.errors import RefusalError
from services.manipulation.inverse import inverse, representations
from services.manipulation.obstacles import Obstacle

_distances = (0.40, 0.50, 0.62)
"""From the camera to the middle of the floor of the box [m]."""
_tilts = (0.0, 15.0, 30.0)
"""Of the view from straight down [deg]."""
_azimuths, _rolls, _grid = 12, 8, 5
_least_seen = 0.6
"""Share of the floor that a look must show."""
_tries = 40
_wall = 0.02
"""Taken off the sides of a box for its walls [m]."""


@dataclass(frozen=True)
class Look:
    """One posture to look from."""

    joints: Floats
    """(6,) [rad]"""
    seen: float
    """Share of the floor of the box in view."""


@dataclass(frozen=True)
class Glance:
    """One of several looks around, where nothing was found at first."""

    back_up: float
    """How far behind the first place the base stands [m]."""
    pan: float
    """How far the arm turns about its foot, counter-clockwise [rad]."""


SWEEP = (
    Glance(0.0, 0.0),
    Glance(0.4, 0.0),
    Glance(0.4, math.radians(30.0)),
    Glance(0.4, math.radians(-30.0)),
)
"""The paper's: back up, and pan to both sides."""


def panned(arm: ArmSpec, joints: Floats, angle: float) -> Floats:
    """A posture turned about the arm's foot by an angle [rad], within the joint's range."""
    turned = joints.copy()
    turned[0] = np.clip(turned[0] + angle, arm.limits.low[0], arm.limits.high[0])
    return turned


def look_into(
    robot: RobotSpec,
    base_from_box: Floats,
    size: Floats,
    obstacles: Sequence[Obstacle],
    near: Floats,
    opening: float,
) -> Look:
    """The posture that sees most of the floor of an open box, and of equal ones the nearest.

    Args:
        robot: with an arm.
        base_from_box: (4, 4), the origin in the middle of the box.
        size: (3,) of the box [m].
        obstacles: what not to touch, the box's walls among it.
        near: where the joints are (6,) [rad].
        opening: gap between the pads; open fingers hide less [m].

    Raises:
        RefusalError: no posture sees enough of it.
    """
    assert robot.arm is not None
    cameras = _cameras(base_from_box, size)
    seen = _share_seen(robot.arm.camera, cameras, base_from_box, size)
    postures = _postures(robot.arm, cameras, seen, near)
    collision = ArmCollision(robot.arm, obstacles, opening)
    for look in postures[:_tries]:
        if collision.free(look.joints):
            return look
    reason = (
        f"the box is {np.hypot(*base_from_box[:2, 3]):.2f} m away, and no posture within reach "
        f"shows {_least_seen:.0%} of its floor"
        if not postures
        else f"where the camera would look from, {collision.touching(postures[0].joints)}"
    )
    raise RefusalError(HandlingFailure.UNREACHABLE, reason)


def _cameras(base_from_box: Floats, size: Floats) -> Floats:
    """Poses `base_from_camera` (N, 4, 4) that look at the middle of the floor from above."""
    views = [
        (distance, math.radians(tilt), k * math.tau / _azimuths, roll * math.tau / _rolls)
        for distance in _distances
        for tilt in _tilts
        for k in range(_azimuths if tilt else 1)
        for roll in range(_rolls)
    ]
    distance, tilt, azimuth, roll = np.array(views).T
    z = np.stack(
        [np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), -np.cos(tilt)], axis=1
    )
    level = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=1)
    x = np.cos(roll)[:, None] * level + np.sin(roll)[:, None] * np.cross(z, level)
    frames = np.tile(np.eye(4), (len(views), 1, 1))
    frames[:, :3, :3] = np.stack([x, np.cross(z, x), z], axis=2)
    floor = base_from_box[:3, 3] - base_from_box[:3, 2] * size[2] / 2
    frames[:, :3, 3] = floor - distance[:, None] * z
    return frames


def _share_seen(
    camera: WristCamera, cameras: Floats, base_from_box: Floats, size: Floats
) -> Floats:
    """Share of the floor of a box that each camera (N,) has in view over the rim."""
    half = size[:2] / 2 - _wall
    steps = np.linspace(-0.95, 0.95, _grid)
    flat = np.stack(np.meshgrid(steps * half[0], steps * half[1]), axis=-1).reshape(-1, 2)
    floor = np.column_stack([flat, np.full(len(flat), -size[2] / 2)])
    eyes = (inverse_of(base_from_box) @ cameras)[:, :3, 3]
    # Where the line from the eye to a point of the floor passes the rim.
    shares = size[2] / (eyes[:, 2] + size[2] / 2)
    rim = floor[None] + shares[:, None, None] * (eyes[:, None] - floor[None])
    over_rim = (np.abs(rim[..., :2]) < half).all(axis=-1) & (shares < 1)[:, None]
    in_base = floor @ base_from_box[:3, :3].T + base_from_box[:3, 3]
    return (over_rim & _in_picture(camera, cameras, in_base)).mean(axis=1)


def _in_picture(camera: WristCamera, cameras: Floats, points: Floats) -> Flags:
    """Which points (P, 3) each camera (N, 4, 4) has in its picture, (N, P)."""
    local = np.einsum("nki,npk->npi", cameras[:, :3, :3], points[None] - cameras[:, None, :3, 3])
    across = math.tan(camera.horizontal_fov / 2)
    bounds = np.array([across, across * camera.height / camera.width])
    return (np.abs(local[..., :2]) < bounds * local[..., 2:]).all(axis=-1)


def _postures(arm: ArmSpec, cameras: Floats, seen: Floats, near: Floats) -> list[Look]:
    """All postures that show enough, best first."""
    kept = seen >= _least_seen
    flanges = cameras[kept] @ inverse_of(matrix(arm.camera.flange_from_camera))
    answers = inverse(arm, inverse_of(matrix(arm.base_from_foot)) @ flanges)
    looks = [
        (share, posture)
        for share, joints, valid in zip(seen[kept], answers.joints, answers.valid, strict=True)
        for posture in representations(arm, joints[valid], near)
    ]
    looks.sort(key=lambda one: (-round(float(one[0]), 1), float(np.abs(one[1] - near).max())))
    return [Look(posture, float(share)) for share, posture in looks]
