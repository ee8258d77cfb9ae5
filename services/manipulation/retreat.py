"""Out of narrow places: straight up, before the arm goes anywhere else."""

from __future__ import annotations

from services.manipulation.errors import RefusalError
from services.manipulation.motions import smooth_motion
from services.manipulation.straight import straight, tool_frame
from services.manipulation.timing import Motion
from services.manipulation.workspace import Move, Plan, Steps, Workspace

_heights = (0.35, 0.28, 0.22, 0.16, 0.10)
"""By which the hand is raised, the first that can be gone [m]."""
_slow = 0.5
"""Share of the arm's speed."""


def freed(work: Workspace) -> Steps:
    """Raise the hand where the arm stands too near to something for a motion to begin.

    A stop or a failure may have left it in a box.

    Raises:
        RefusalError: what it is too near to, where it cannot be raised either.
    """
    if work.collision().free(work.joints):
        return "nothing is near"
    motion_up = _upwards(work)
    yield Plan("thinking how to get out")
    yield Move(motion_up, "raising the hand")
    return "raised"


def _upwards(work: Workspace) -> Motion:
    # Whatever is near already may stay as near as it is: only a touch forbids to leave it.
    touching = work.collision(clearance=0.0)
    refused: RefusalError | None = None
    for height in _heights:
        end = tool_frame(work.arm, work.joints)
        end[2, 3] += height
        try:
            way = straight(work.arm, work.joints, end)
            return smooth_motion(work.arm, touching, way, _slow)
        except RefusalError as refusal:
            refused = refusal
    assert refused is not None
    raise refused
