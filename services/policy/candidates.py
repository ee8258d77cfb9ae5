"""What the robot could do next: the action set A_t of Eq. policy."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from schemas.arrays import Floats, Ints
from schemas.geometry import Pose2


class Kind(StrEnum):
    """Kinds of candidates, as in `schemas.task.Decision`."""

    OBSERVED = "observed"
    """Drive up to something that was seen."""
    HYPOTHESISED = "hypothesised"
    """Look at where something may be."""
    FRONTIER = "frontier"
    """Look at ground that nobody has looked at."""
    INSIDE = "inside"
    """Drive up to something that was seen and look into it."""
    STOP = "stop"


@dataclass(frozen=True)
class Candidates:
    """C candidates as columns."""

    kinds: tuple[Kind, ...]
    target: Floats
    """(C, 2) What it is about, map frame [m]."""
    pose: Floats
    """(C, 3) Where the robot would stand and look: x, y, yaw, map frame."""
    object_id: Ints
    """(C,) Seen object that it is about, -1 for none."""

    def __len__(self) -> int:
        return len(self.kinds)

    def take(self, rows: Ints) -> "Candidates":
        """Rows by index."""
        kinds = tuple(self.kinds[row] for row in rows.tolist())
        return Candidates(kinds, self.target[rows], self.pose[rows], self.object_id[rows])


def looking(kind: Kind, target: Floats, position: Floats, object_id: int = -1) -> Candidates:
    """Candidates that stand at positions (N, 2) and look at targets (N, 2)."""
    toward = target - position
    yaw = np.arctan2(toward[:, 1], toward[:, 0])
    ids = np.full(len(target), object_id, np.int32)
    return Candidates((kind,) * len(target), target, np.column_stack([position, yaw]), ids)


def stop_at(map_from_base: Pose2, object_id: int) -> Candidates:
    """To declare that the robot stands at `object_id`, the thing that was meant."""
    pose = np.array([[map_from_base.x, map_from_base.y, map_from_base.yaw]])
    return Candidates((Kind.STOP,), pose[:, :2], pose, np.array([object_id], np.int32))


def joined(parts: list[Candidates]) -> Candidates:
    """All rows of several sets, in order."""
    return Candidates(
        tuple(kind for part in parts for kind in part.kinds),
        np.concatenate([part.target for part in parts]),
        np.concatenate([part.pose for part in parts]),
        np.concatenate([part.object_id for part in parts]),
    )
