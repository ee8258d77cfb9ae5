"""Detections between two pose nodes, fused into one sighting for each object."""

import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2
from services.mapping.graph import Sighting

_floor = 0.05**2 * np.eye(2)
"""Errors of successive pictures are alike, so fusing many must not make them vanish [m^2]."""


class Sightings:
    """Sum of information about each object in the frame of the last pose node."""

    def __init__(self) -> None:
        self._information: dict[int, Floats] = {}
        self._vector: dict[int, Floats] = {}
        self._count: dict[int, int] = {}

    @property
    def most(self) -> int:
        """Number of pictures that the most often seen object was seen in."""
        return max(self._count.values(), default=0)

    def add(
        self, number: int, node_from_base: Pose2, point_base: Floats, covariance: Floats
    ) -> None:
        """Fuse a point (2,) with its covariance (2, 2), base frame."""
        rotation = node_from_base.lifted().rotation()[:2, :2]
        information = np.linalg.inv(rotation @ covariance @ rotation.T)
        vector = information @ node_from_base.apply(point_base)
        self._information[number] = self._information.get(number, np.zeros((2, 2))) + information
        self._vector[number] = self._vector.get(number, np.zeros(2)) + vector
        self._count[number] = self._count.get(number, 0) + 1

    def take(self, pose: int) -> list[Sighting]:
        """All sightings as edges from a pose node; nothing is left behind."""
        edges = [self._edge(pose, number) for number in self._information]
        self._information, self._vector, self._count = {}, {}, {}
        return edges

    def _edge(self, pose: int, number: int) -> Sighting:
        covariance = np.linalg.inv(self._information[number])
        point = covariance @ self._vector[number]
        return Sighting(pose, number, point, covariance + _floor, None)
