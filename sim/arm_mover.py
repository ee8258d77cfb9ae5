"""The arm and its gripper under their governors."""

from __future__ import annotations

import numpy as np

from robots.arm import ArmSpec
from schemas.arrays import Floats
from sim.arm import ArmBody
from sim.arm_governor import ArmGovernor, GripperGovernor


class ArmMover:
    """Moves an arm's body as commanded, within its limits; it begins stowed, the gripper shut."""

    def __init__(self, body: ArmBody, arm: ArmSpec) -> None:
        self.body = body
        self._arm = arm
        self.place(np.r_[arm.poses["stow"], 0.0, 0.0], 0.0)

    def place(self, positions: Floats, opening: float) -> None:
        """Put joints and fingers (8,) somewhere, at rest, the gripper going for a gap [m]."""
        self.body.place(positions)
        self.governor = ArmGovernor(self._arm.limits, positions[:6])
        self.gripper = GripperGovernor(self._arm.gripper, opening)

    def latch(self, stopped: bool) -> None:
        """Hold until released with False."""
        self.governor.latch(stopped)
        self.gripper.latch(stopped)

    def advance(self, now_ns: int, duration: float) -> None:
        """Set the drives for the next `duration` seconds."""
        setpoint = self.governor.advance(now_ns, duration)
        self.body.drive(setpoint, self.gripper.advance(duration))
