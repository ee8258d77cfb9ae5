"""What the camera will see from a pose, before the robot is there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.spec import CameraSpec
from schemas.arrays import Floats
from services.policy.terrain import Terrain

_edge = np.radians(4.0)
"""Objects this near the edge of the picture are cut off and not counted [rad]."""
_detected_sharp = 0.9


@dataclass(frozen=True)
class FieldOfView:
    """A camera's view on the ground plane."""

    half_angle: float
    """[rad]"""
    range_max: float
    """[m]"""
    near: float
    sharp_share: float
    blind_share: float
    """As in `CameraSpec`."""

    @property
    def reach(self) -> float:
        """Within it objects are more likely detected than not [m]."""
        return self.range_max * (self.sharp_share + self.blind_share) / 2

    @property
    def area(self) -> float:
        """Of the ground in one full view [m^2]."""
        return self.half_angle * self.range_max**2

    @staticmethod
    def of(camera: CameraSpec) -> "FieldOfView":
        """The field of view that a camera is trusted with."""
        half = camera.horizontal_fov / 2
        return FieldOfView(
            # A camera that looks all round has no edge.
            half_angle=half - _edge if half < np.pi else half,
            range_max=camera.range_max,
            near=camera.near,
            sharp_share=camera.sharp_share,
            blind_share=camera.blind_share,
        )

    def detection(self, poses: Floats, points: Floats, terrain: Terrain) -> Floats:
        """Probability (C, N) to detect an object at points (N, 2) from poses x, y, yaw (C, 3)."""
        pose, point = self._pairs_in_range(poses, points)
        offset = points[point] - poses[pose, :2]
        distance = np.hypot(offset[:, 0], offset[:, 1])
        bearing = np.arctan2(offset[:, 1], offset[:, 0]) - poses[pose, 2]
        off_axis = np.abs((bearing + np.pi) % (2 * np.pi) - np.pi)
        shown = (off_axis < self.half_angle) & (distance > self.near)
        pose, point, distance = pose[shown], point[shown], distance[shown]
        probability = np.zeros((len(poses), len(points)))
        sight = terrain.in_sight(poses[pose, :2], points[point])
        probability[pose, point] = sight * self._detected(distance)
        return probability

    def _pairs_in_range(
        self, poses: Floats, points: Floats
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The few pairs near enough to each other, so that angles are computed for no others."""
        square = (points[:, 0] - poses[:, :1]) ** 2 + (points[:, 1] - poses[:, 1:2]) ** 2
        pose, point = np.nonzero(square < (self.blind_share * self.range_max) ** 2)
        return pose, point

    def _detected(self, distance: Floats) -> Floats:
        width = self.blind_share - self.sharp_share
        fall = (self.blind_share - distance / self.range_max) / width
        return _detected_sharp * np.clip(fall, 0.0, 1.0)
