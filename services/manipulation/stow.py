"""The task of folding the arm for driving."""

from __future__ import annotations

import numpy as np

from services.manipulation.retreat import freed
from services.manipulation.workspace import Move, Plan, Steps, Workspace

_there = 0.02
"""Joints that are this near to where they are to be need no motion [rad]."""


def stow(work: Workspace) -> Steps:
    """Fold the arm; what it holds is carried before the bumper.

    Raises:
        RefusalError: no way leads there.
    """
    goal = np.array(work.arm.poses["carry" if work.grasp else "stow"])
    if np.abs(work.joints - goal).max() > _there:
        yield from freed(work)
        motion = work.way_to(goal[None])
        yield Plan("thinking how to fold the arm")
        yield Move(motion, f"carrying the {work.grasp.label}" if work.grasp else "folding the arm")
    return "ready to drive"
