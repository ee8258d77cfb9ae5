"""What the arm must not touch, as simple shapes in the frame of the base."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robots.arm_kinematics import matrix
from robots.spec import RobotSpec
from schemas.arrays import Floats
from schemas.geometry import Pose3
from schemas.perception import SOLID_KINDS, Bodies

_ground_side, _ground_thickness = 6.0, 0.2
_mast_width = 0.05


@dataclass(frozen=True)
class Obstacle:
    """One shape."""

    kind: str
    """One of `SOLID_KINDS`."""
    base_from_shape: Floats
    """(4, 4), the origin in the middle of the shape."""
    size: Floats
    """(3,) [m], as in `Bodies`."""
    name: str
    """What it belongs to, for people."""


def box(
    name: str, center: tuple[float, float, float], size: tuple[float, float, float]
) -> Obstacle:
    """A box along the axes of the base [m]."""
    return Obstacle("box", matrix(Pose3(center, (1.0, 0.0, 0.0, 0.0))), np.array(size), name)


def from_bodies(
    bodies: Bodies, labels: tuple[str, ...], base_from_then: Pose3, without: int | None = None
) -> list[Obstacle]:
    """The solids of what perception saw.

    Args:
        bodies: of one frame.
        labels: class of each row.
        base_from_then: from the base at the frame to the base now.
        without: row of the thing that is to be touched.
    """
    made: list[Obstacle] = []
    for solid in range(len(bodies.solid_rows)):
        row = int(bodies.solid_rows[solid])
        if row == without:
            continue
        inner = np.eye(4)
        inner[:3, 3] = bodies.solid_centers[solid]
        place = matrix(base_from_then) @ body_frame(bodies, row) @ inner
        kind = SOLID_KINDS[int(bodies.solid_kinds[solid])]
        made.append(Obstacle(kind, place, bodies.solid_sizes[solid], labels[row]))
    return made


def body_frame(bodies: Bodies, row: int) -> Floats:
    """`base_from_box` (4, 4) of one object, the base being that of the frame."""
    x, y, z = bodies.positions_base[row].tolist()
    w, i, j, k = bodies.wxyz_base[row].tolist()
    return matrix(Pose3((x, y, z), (w, i, j, k)))


def own_body(robot: RobotSpec) -> list[Obstacle]:
    """The robot's base, the mast of its camera and the ground that it stands on."""
    base, mast = robot.base, robot.camera.base_from_camera.position
    length = mast[2] - base.height + 0.05
    return [
        box("base", (0, 0, base.height / 2), (base.length, base.width, base.height)),
        box(
            "mast",
            (mast[0] - 0.05, mast[1], base.height + length / 2),
            (0.10, _mast_width, length),
        ),
        box("camera", (mast[0] - 0.03, mast[1], mast[2]), (0.08, 0.18, 0.08)),
        box(
            "ground",
            (0.0, 0.0, -_ground_thickness / 2),
            (_ground_side, _ground_side, _ground_thickness),
        ),
    ]
