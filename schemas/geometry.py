"""Poses. Names read `a_from_b`: they map coordinates in frame b to coordinates in frame a.

Frames: `map` (the filter's estimate, drift corrected), `odom` (dead reckoning, smooth, drifts),
`base` (on the ground between the wheels, +x forward, +y left, +z up), `camera` (+x right, +y down,
+z forward), `laser` (as base).
"""

import math

import numpy as np
from msgspec import Struct

from schemas.arrays import Floats


class Pose2(Struct, frozen=True, array_like=True):
    """Planar pose of one frame in another."""

    x: float
    """[m]"""
    y: float
    """[m]"""
    yaw: float
    """Counter-clockwise [rad]."""

    def __matmul__(self, other: "Pose2") -> "Pose2":
        """Compose: `a_from_b @ b_from_c` is `a_from_c`."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            wrap_angle(self.yaw + other.yaw),
        )

    def inverse(self) -> "Pose2":
        """`b_from_a` of an `a_from_b`."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(-c * self.x - s * self.y, s * self.x - c * self.y, wrap_angle(-self.yaw))

    def apply(self, points: Floats) -> Floats:
        """Transform points (..., 2) [m]."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        rotation = np.array([[c, -s], [s, c]])
        return points @ rotation.T + np.array([self.x, self.y])

    def lifted(self) -> "Pose3":
        """The same pose in space, on the ground plane."""
        half = self.yaw / 2
        return Pose3((self.x, self.y, 0.0), (math.cos(half), 0.0, 0.0, math.sin(half)))


class Pose3(Struct, frozen=True, array_like=True):
    """Pose of one frame in another, in space."""

    position: tuple[float, float, float]
    """[m]"""
    wxyz: tuple[float, float, float, float]
    """Unit quaternion, scalar first."""

    def rotation(self) -> Floats:
        """Rotation matrix (3, 3)."""
        w, x, y, z = self.wxyz
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    def apply(self, points: Floats) -> Floats:
        """Transform points (..., 3) [m]."""
        return points @ self.rotation().T + np.array(self.position)

    def __matmul__(self, other: "Pose3") -> "Pose3":
        """Compose: `a_from_b @ b_from_c` is `a_from_c`."""
        x, y, z = self.apply(np.array(other.position)).tolist()
        return Pose3((x, y, z), quaternion_product(self.wxyz, other.wxyz))

    def inverse(self) -> "Pose3":
        """`b_from_a` of an `a_from_b`."""
        w, x, y, z = self.wxyz
        px, py, pz = (-(self.rotation().T @ np.array(self.position))).tolist()
        return Pose3((px, py, pz), (w, -x, -y, -z))


Quaternion = tuple[float, float, float, float]


def quaternion_product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Hamilton product of two wxyz quaternions."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def wrap_angle(angle: float) -> float:
    """The same direction in [-pi, pi) [rad]."""
    return (angle + math.pi) % (2 * math.pi) - math.pi
