"""Carrying out a motion: what to send, and whether the arm follows."""

from __future__ import annotations

from enum import Enum, auto

import numpy as np

from schemas.arrays import Floats
from schemas.motion import ArmCommand
from services.manipulation.motions import at
from services.manipulation.timing import Motion

VALID_MS = 250
"""A command outlives a lost successor, not a dead planner [ms]."""
_arrived = 0.02
"""Nearer than this to its end the motion is done [rad]."""
_behind = 0.25
"""Further than this from where it should be the arm does not follow [rad]."""
_patience_s = 1.0
"""For an arm that does not follow, or does not arrive [s]."""


class Progress(Enum):
    """How a motion goes."""

    MOVING = auto()
    ARRIVED = auto()
    STUCK = auto()


class Follower:
    """Sends one motion and watches the joints.

    Args:
        motion: what to carry out.
        id: of the motion, unique.
        start_ns: when it begins.
    """

    def __init__(self, motion: Motion, id: str, start_ns: int) -> None:
        self._motion = motion
        self._id = id
        self._start_ns = start_ns
        self._lost_ns: int | None = None

    def command(self, stamp_ns: int) -> ArmCommand:
        """What to send now."""
        return ArmCommand(
            stamp_ns=stamp_ns,
            id=self._id,
            times=self._motion.times,
            positions=self._motion.positions,
            velocities=self._motion.velocities,
            valid_ms=VALID_MS,
        )

    def watch(self, joints: Floats, stamp_ns: int) -> Progress:
        """Judge the motion by where the joints (6,) are [rad]."""
        elapsed = (stamp_ns - self._start_ns) / 1e9
        to_end = float(np.abs(joints - self._motion.positions[-1]).max())
        if elapsed >= self._motion.duration and to_end < _arrived:
            return Progress.ARRIVED
        late = elapsed >= self._motion.duration
        behind = float(np.abs(joints - at(self._motion, elapsed)).max()) > _behind
        if not (late or behind):
            self._lost_ns = None
            return Progress.MOVING
        self._lost_ns = stamp_ns if self._lost_ns is None else self._lost_ns
        stuck = stamp_ns - self._lost_ns > _patience_s * 1e9
        return Progress.STUCK if stuck else Progress.MOVING
