"""Scans at pose nodes, and which of them a new one is compared with."""

from dataclasses import dataclass

import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2
from schemas.sensing import LaserScan
from services.mapping.scan_matching import Match, match

_near = 3.0
"""From farther apart two scans show too little of the same [m]."""


@dataclass(frozen=True)
class Edge:
    """A match with an earlier pose node."""

    reference: int
    match: Match


class ScanMemory:
    """The scan of each pose node that has one."""

    def __init__(self) -> None:
        self.latest: Floats | None = None
        """(n, 2) The last scan in the frame of dead reckoning [m]."""
        self._scans: dict[int, Floats] = {}

    def seen_from(self, odom_from_base: Pose2) -> Floats | None:
        """The last scan (n, 2) in the frame of a pose near the one that it was taken from."""
        return None if self.latest is None else odom_from_base.inverse().apply(self.latest)

    def edge(self, points: Floats | None, map_from_base: Pose2, poses: Floats) -> Edge | None:
        """The match with the oldest node near by, or with the last one; None if neither fits.

        The oldest was mapped best: so drift does not add up where the robot goes to and fro.
        """
        if points is None:
            return None
        for node in self._candidates(map_from_base, poses):
            guess = Pose2(*poses[node].tolist()).inverse() @ map_from_base
            if found := match(self._scans[node], points, guess):
                return Edge(node, found)
        return None

    def keep(self, node: int, points: Floats | None) -> None:
        """Keep a node's scan."""
        if points is not None:
            self._scans[node] = points

    def _candidates(self, map_from_base: Pose2, poses: Floats) -> list[int]:
        here = np.array([map_from_base.x, map_from_base.y])
        near = [node for node in self._scans if np.hypot(*(poses[node, :2] - here)) < _near]
        return list(dict.fromkeys([*near[:1], *near[-1:]]))


def points_of(scan: LaserScan) -> Floats:
    """Where beams ended (n, 2), base frame, in their order [m]."""
    hit = np.isfinite(scan.ranges) & (scan.ranges > 0) & (scan.ranges < scan.range_max)
    angle = scan.angle_min + scan.angle_increment * np.flatnonzero(hit)
    ranges = scan.ranges[hit].astype(np.float64)
    points = np.stack([ranges * np.cos(angle), ranges * np.sin(angle)], axis=1)
    return scan.base_from_laser.apply(points)
