"""Out of narrow places: straight up, before the arm goes anywhere else."""

from __future__ import annotations

from schemas.task import HandlingFailure
from services.manipulation.errors import RefusalError
from services.manipulation.planning import dense
from services.manipulation.straight import straight, tool_frame
from services.manipulation.timing import Motion, timed
from services.manipulation.workspace import Move, Plan, Steps, Workspace

_heights = (0.35, 0.28, 0.22, 0.16, 0.10)
"""By which the hand is raised, the first that can be gone [m]."""
_slow = 0.5
"""Share of the arm's speed."""
_brushed = 6
"""Steps of about a centimetre on which what was touched at first may be touched still."""
_corner = 0.1
"""How closely the motion keeps to the straight line [rad]."""


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
    refused: RefusalError | None = None
    touching = work.collision(clearance=0.0)
    for height in _heights:
        end = tool_frame(work.arm, work.joints)
        end[2, 3] += height
        try:
            way = straight(work.arm, work.joints, end)
        except RefusalError as refusal:
            refused = refusal
            continue
        # What is touched already may be brushed on the way out of it.
        reason = next(filter(None, (touching.touching(one) for one in way[_brushed:])), "")
        if not reason:
            return timed(work.arm.limits, dense(way, _corner), _slow)
        refused = RefusalError(HandlingFailure.NO_PATH, f"above where the arm is, {reason}")
    assert refused is not None
    raise refused
