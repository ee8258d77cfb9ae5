"""From where a robot looks at rooms: standing in them, before doorways, and in doorways."""

from __future__ import annotations

import math

from numpy.random import Generator

from robots.spec import CameraSpec
from schemas.geometry import Pose2, Pose3, quaternion_product
from sim.scenes.rooms import Room, Suite

_clearance = 0.3
"""Room between the robot's middle and furniture [m]."""
_tries = 200
_heights = (-0.45, 0.1)
"""Of the camera, beside where it is mounted: other robots carry theirs lower [m]."""


def random_pose(rng: Generator, suite: Suite) -> Pose2:
    """Mostly in the first room, looking anywhere; else towards a doorway, in one, or next door."""
    way = rng.random()
    if way < 0.15:
        return _in_doorway(rng, suite)
    room = suite.rooms[0] if way < 0.85 else suite.rooms[int(rng.integers(len(suite.rooms)))]
    x, y = _free_point(rng, suite, room)
    if way < 0.4:
        return Pose2(x, y, _towards_doorway(rng, suite, x, y))
    return Pose2(x, y, rng.uniform(-math.pi, math.pi))


def raised_mount(rng: Generator, camera: CameraSpec) -> Pose3:
    """`base_from_camera` of some robot: the camera's own, higher or lower."""
    up = Pose3((0.0, 0.0, rng.uniform(*_heights)), (1.0, 0.0, 0.0, 0.0))
    return up @ camera.base_from_camera


def tilted(rng: Generator, world_from_base: Pose2) -> Pose3:
    """The base as it pitches and rolls a little."""
    pitch, roll = rng.normal(0, 0.03), rng.normal(0, 0.015)
    tilt = quaternion_product(
        (math.cos(pitch / 2), 0.0, math.sin(pitch / 2), 0.0),
        (math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0),
    )
    return world_from_base.lifted() @ Pose3((0.0, 0.0, 0.0), tilt)


def _free_point(rng: Generator, suite: Suite, room: Room) -> tuple[float, float]:
    """A point where the robot fits; in a room that is too crowded, any point."""
    x0, y0, x1, y1 = room.floor
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    for _ in range(_tries):
        x, y = rng.uniform(x0 + 0.35, x1 - 0.35), rng.uniform(y0 + 0.35, y1 - 0.35)
        if not any(
            a - _clearance < x < c + _clearance and b - _clearance < y < d + _clearance
            for a, b, c, d in suite.blocked
        ):
            break
    return x, y


def _towards_doorway(rng: Generator, suite: Suite, x: float, y: float) -> float:
    door = suite.doors[int(rng.integers(len(suite.doors)))] if suite.doors else (x, y, x + 1, y)
    bearing = math.atan2((door[1] + door[3]) / 2 - y, (door[0] + door[2]) / 2 - x)
    return bearing + rng.normal(0, 0.3)


def _in_doorway(rng: Generator, suite: Suite) -> Pose2:
    """Within 0.8 m of a doorway's middle, looking through it one way or the other."""
    if not suite.doors:
        return Pose2(*_free_point(rng, suite, suite.rooms[0]), rng.uniform(-math.pi, math.pi))
    x0, y0, x1, y1 = suite.doors[int(rng.integers(len(suite.doors)))]
    through = 0.0 if x1 - x0 < y1 - y0 else math.pi / 2
    yaw = through + math.pi * int(rng.integers(2)) + rng.normal(0, 0.3)
    off = rng.uniform(-0.8, 0.8)
    x = (x0 + x1) / 2 + off * math.cos(through)
    y = (y0 + y1) / 2 + off * math.sin(through)
    return Pose2(x, y, yaw)
