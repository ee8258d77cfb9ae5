"""How near the robot stands to a seen thing: to declare it found, or for an arm to reach it."""

from dataclasses import dataclass

import numpy as np

from robots.spec import RobotSpec
from schemas.arrays import Floats
from schemas.belief import MapBelief
from schemas.geometry import Pose2, wrap_angle
from services.policy.places import stand_off

within_reach = 0.8
"""From the surface of what an arm is to reach to the centre of the base [m]."""
_slack, _reach_slack = 0.15, 0.2
"""Farther from where to stand than this is not at the thing, without an arm and with one [m]."""
_ahead = np.radians(30.0)
"""An arm reaches what lies within this angle to either side."""
_spoilt = 0.3
"""Nearer than this to where it could not be reached from it cannot be either [m]."""


@dataclass(frozen=True)
class Standing:
    """The rule of one robot."""

    gap: float
    """From the surface of a thing to where the robot is to stand [m]."""
    slack: float
    """[m]"""
    facing: float
    """Half of the angle before the robot in which the thing must lie [rad]."""
    containers: tuple[str, ...]
    """Classes of things that others may lie in."""

    @staticmethod
    def of(spec: RobotSpec) -> "Standing":
        """With an arm the robot stands nearer, and faces the thing."""
        containers = spec.symbols.containers
        if spec.arm is None:
            return Standing(stand_off, _slack, np.pi, containers)
        return Standing(within_reach, _reach_slack, float(_ahead), containers)

    def around(self, belief: MapBelief, row: int) -> tuple[Floats, float]:
        """Middle (2,) and radius of what the robot stands at: a thing, or the box that it is in."""
        point = belief.position[row]
        for box in np.flatnonzero(belief.seen).tolist():
            holds = belief.classes[belief.class_index[box]] in self.containers
            gap = float(np.hypot(*(belief.position[box] - point)))
            if holds and box != row and gap < radius_of(belief, box):
                return belief.position[box], radius_of(belief, box)
        return point, radius_of(belief, row)

    def is_at(self, belief: MapBelief, row: int, pose: Pose2, refused: Floats) -> bool:
        """Whether the robot stands at a seen thing.

        Args:
            belief: that tells of it.
            row: of the thing.
            pose: of the robot, map frame.
            refused: (R, 2) where it stood in vain, map frame [m].
        """
        center, radius = self.around(belief, row)
        toward = center - (pose.x, pose.y)
        off = abs(wrap_angle(float(np.arctan2(toward[1], toward[0])) - pose.yaw))
        near = float(np.hypot(*toward)) - radius <= self.gap + self.slack
        if not near or off > self.facing:
            return False
        spoilt = np.hypot(*(refused - (pose.x, pose.y)).T) < _spoilt
        # Only an arm cannot reach from where the base has arrived.
        return self.facing == np.pi or not spoilt.any()


def radius_of(belief: MapBelief, row: int) -> float:
    """Of the circle that a seen thing fills, about [m]."""
    return 0.25 * float(belief.extent[row, 0] + belief.extent[row, 1])
