"""When to decide again. Deciding on every belief makes the robot dither."""

from dataclasses import dataclass

import numpy as np

from schemas.belief import MapBelief
from schemas.geometry import Pose2
from services.policy.candidates import Candidates, Kind
from services.policy.referents import Referents

_after_metres = 2.0
_after_s = 20.0
"""So long without a decision means that the goal was lost on the way [s]."""
_settle_s = 0.6
"""After arriving, until the camera's view from there has entered the belief [s]."""
_around_target = 2.0
_spent_below = 0.3
"""A place is spent when it holds less than this share of what it held when it was chosen."""


@dataclass
class Pace:
    """The circumstances of the last decision."""

    stamp_ns: int
    """When it was taken."""
    pose: Pose2
    """Where it was taken."""
    seen: frozenset[int]
    """What had been seen."""
    following: Candidates
    """What was chosen, one row."""
    hidden: float
    """`hidden_mass` at its target."""
    passing_m: float = 0.0
    """This near to where it leads the next choice is made, so that the robot need not stop [m]."""
    ended_ns: int | None = None
    """When its goal was reached or failed."""

    def is_due(
        self, belief: MapBelief, referents: Referents, pose: Pose2, goal: int | None
    ) -> bool:
        """Whether something happened that may change the decision.

        Args:
            belief: newest.
            referents: of it.
            pose: map_from_base now.
            goal: seen object that is meant beyond doubt, or None.
        """
        if belief.stamp_ns - self.stamp_ns > _after_s * 1e9:
            self.ended_ns = belief.stamp_ns
            return True
        if self.ended_ns is not None:
            return belief.stamp_ns - self.ended_ns >= _settle_s * 1e9
        moved = float(np.hypot(pose.x - self.pose.x, pose.y - self.pose.y)) >= _after_metres
        found = goal is not None and self.following.object_id[0] != goal
        news = bool(seen_objects(belief) - self.seen)
        return moved or found or news or self._is_spent(referents) or self._is_passing(pose)

    def _is_passing(self, pose: Pose2) -> bool:
        """Whether the robot came near to a place it only wants to look from."""
        if self.following.object_id[0] >= 0:
            return False
        end = self.following.pose[0, :2]
        before, now = (np.hypot(*(end - (at.x, at.y))) for at in (self.pose, pose))
        return bool(now < self.passing_m <= before)

    def _is_spent(self, referents: Referents) -> bool:
        if self.following.kinds[0] is not Kind.HYPOTHESISED:
            return False
        return hidden_mass(referents, self.following) < _spent_below * self.hidden


def seen_objects(belief: MapBelief) -> frozenset[int]:
    """Ids of everything that was seen."""
    return frozenset(belief.node[belief.seen].tolist())


def hidden_mass(referents: Referents, following: Candidates) -> float:
    """Posterior mass of unseen figures and landmarks around a candidate's target."""
    near_figure = np.hypot(*(referents.figure - following.target).T) < _around_target
    near_landmark = np.hypot(*(referents.landmark - following.target).T) < _around_target
    hidden = near_figure & ~referents.figure_seen | near_landmark & ~referents.landmark_seen
    return float(referents.probability[hidden & referents.known].sum())
