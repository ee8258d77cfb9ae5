"""How far it is to the goal in each hypothesis, if a candidate is taken first.

The robot does not know which hypothesis holds, so the way to a thing that nobody saw yet leads
over places that turn out to be empty. What follows after the candidate is a sweep: again and again
to the place that shows most of what is left for its way. Until something comes into view all
hypotheses share this sweep; from then on each is taken to be known (the figure is where it says).
The first moment of the result is the expected way of the plan that begins with the candidate, which
a rule that only weighs the next look against its way cannot see (a rollout, Bertsekas and Castanon
1999).
"""

from dataclasses import dataclass

import numpy as np

from schemas.arrays import Flags, Floats, Ints
from services.policy.candidates import Candidates
from services.policy.places import stand_off
from services.policy.referents import Referents
from services.policy.sight import Legs, distances, shown_from
from services.policy.view import FieldOfView

_eagerness = (0.3, 1.0, 4.0)
"""Sweeps that are tried [m]: the smaller, the rather the near first. The best of them counts."""
_looks = 14
"""Places that a sweep goes over, at most."""
_least_share = 0.01
_not_found = 15.0
"""Added to the way of what the whole sweep does not show [m]."""
_pause = 1.0
"""Every move costs a look and a decision, worth this much of way [m]."""
_overlap = 0.8
"""Looks are this share of the reach apart, so that no gaps are left between them."""


@dataclass(frozen=True)
class Quest:
    """What is left to be seen, in H hypotheses."""

    weight: Floats
    """(H,) Sums to one."""
    figure: Floats
    """(H, 2), map frame [m]"""
    landmark: Floats
    """(H, 2), map frame [m]"""
    figure_seen: Flags
    """(H,)"""
    landmark_seen: Flags
    """(H,)"""

    def resolved(self, figure_at: Floats, landmark_at: Floats) -> Floats:
        """How far along (..., H) something new comes into view, by when each thing does."""
        figure = np.where(self.figure_seen, np.inf, figure_at)
        return np.minimum(figure, np.where(self.landmark_seen, np.inf, landmark_at))

    def rest(self, x: Floats, y: Floats, figure_first: Flags, view: FieldOfView) -> Floats:
        """Way to the figure (..., H) from the place x, y where something came into view.

        Where the landmark is still to be confirmed the way leads to where it is seen first.
        """
        gap_x, gap_y = self.landmark[:, 0] - x, self.landmark[:, 1] - y
        distance = np.sqrt(gap_x * gap_x + gap_y * gap_y)
        detour = np.maximum(distance - view.reach, 0.0) * (figure_first & ~self.landmark_seen)
        share = detour / np.maximum(distance, 1e-9)
        rest_x = self.figure[:, 0] - x - share * gap_x
        rest_y = self.figure[:, 1] - y - share * gap_y
        return detour + _last_leg(np.sqrt(rest_x * rest_x + rest_y * rest_y))


@dataclass(frozen=True)
class _Ways:
    """What straight ways show, and what is left to drive from there."""

    length: Floats
    """(A, B) [m]"""
    at: Floats
    """(A, B, H) Way until something new is seen, infinite if nothing is [m]."""
    rest: Floats
    """(A, B, H) [m]"""


def way_to_goal(
    pose: Floats, lengths: Floats, candidates: Candidates, referents: Referents, view: FieldOfView
) -> Floats:
    """Way (C, M) [m] to the figure of each reading, if each candidate is taken first.

    Args:
        pose: (3,) x, y, yaw of the base, map frame.
        lengths: (C,) of the ways to the candidates, round obstacles [m].
        candidates: C of them.
        referents: M readings.
        view: how far and how wide the robot sees.
    """
    own = (candidates.object_id[:, None] == referents.figure_id) & referents.figure_seen
    rest = distances(candidates.pose[:, :2], referents.figure)
    ways = lengths[:, None] + np.where(own, 0.0, _last_leg(rest))
    pending, quest = _quest(referents)
    if len(pending):
        ways[:, pending] = _planned(pose, lengths, candidates, quest, view)
    expected = ways[:, referents.known] @ _share(referents.probability[referents.known])
    # What no hypothesis explains is no reason to prefer one candidate.
    return np.where(referents.known, ways, expected[:, None])


def _last_leg(distance: Floats) -> Floats:
    """Way to a thing at a distance, which is yet another move [m]."""
    return np.maximum(distance - stand_off, 0.0) + _pause


def _share(weight: Floats) -> Floats:
    return weight / max(float(weight.sum()), 1e-12)


def _quest(referents: Referents) -> tuple[Ints, Quest]:
    """Rows of the readings in which something is left to see, and these as a quest."""
    rows = np.flatnonzero(referents.known & ~referents.found).astype(np.int32)
    # Ties are broken by place, so that the order of the hypotheses means nothing.
    keys = np.concatenate([referents.figure[rows].T, referents.landmark[rows].T])
    rows = rows[np.lexsort(keys)]
    quest = Quest(
        weight=_share(referents.probability[rows]),
        figure=referents.figure[rows],
        landmark=referents.landmark[rows],
        figure_seen=referents.figure_seen[rows],
        landmark_seen=referents.landmark_seen[rows],
    )
    return rows, quest


def _planned(
    pose: Floats, lengths: Floats, candidates: Candidates, quest: Quest, view: FieldOfView
) -> Floats:
    """Ways (C, H) of the best sweep after each candidate."""
    looks = _places_to_look(quest, view)
    first = _to_candidates(pose, lengths, candidates, quest, view)
    then = _between(candidates.pose[:, :2], looks, quest, view)
    later = _between(looks, looks, quest, view)
    sweeps = np.stack([_swept(first, then, later, quest, eager) for eager in _eagerness])
    best = np.argmin(sweeps @ quest.weight, axis=0)
    return sweeps[best, np.arange(len(candidates))]


def _places_to_look(quest: Quest, view: FieldOfView) -> Floats:
    """Few places (N, 2) that together show everything that is left: greedy cover."""
    figure, landmark = ~quest.figure_seen, ~quest.landmark_seen
    places = np.concatenate([quest.figure[figure], quest.landmark[landmark]])
    left = np.concatenate([quest.weight[figure], quest.weight[landmark]])
    near = (distances(places, places) < _overlap * view.reach).astype(np.float64)
    chosen: list[int] = []
    while len(chosen) < _looks:
        gain = near @ left
        best = int(np.argmax(gain))
        if gain[best] < _least_share:
            break
        chosen.append(best)
        left = left * (1 - near[best])
    return places[chosen]


def _to_candidates(
    pose: Floats, lengths: Floats, candidates: Candidates, quest: Quest, view: FieldOfView
) -> _Ways:
    """The ways to the candidates, and the look from there: A = 1, B = C."""
    legs = Legs.between(pose[None, :2], candidates.pose[:, :2])
    stretch = lengths[:, None] / np.maximum(legs.length[0], 1e-9)[:, None]

    def first(points: Floats) -> Floats:
        on_the_way = legs.first_sight(points, view)[0]
        look = shown_from(candidates.pose, points, view) + lengths[:, None]
        seen = np.isfinite(on_the_way)
        return np.where(seen, np.where(seen, on_the_way, 0.0) * stretch, look)[None]

    return _ways(legs, lengths[None], first(quest.figure), first(quest.landmark), quest, view)


def _between(starts: Floats, ends: Floats, quest: Quest, view: FieldOfView) -> _Ways:
    """Straight ways between places (A, 2) and (B, 2)."""
    legs = Legs.between(starts, ends)
    figure_at = legs.first_sight(quest.figure, view)
    landmark_at = legs.first_sight(quest.landmark, view)
    return _ways(legs, legs.length, figure_at, landmark_at, quest, view)


def _ways(
    legs: Legs,
    length: Floats,
    figure_at: Floats,
    landmark_at: Floats,
    quest: Quest,
    view: FieldOfView,
) -> _Ways:
    at = quest.resolved(figure_at, landmark_at)
    driven = np.where(np.isfinite(at), at, 0.0) / np.maximum(length, 1e-9)[..., None]
    driven = np.minimum(driven, 1.0) * legs.length[..., None]
    x, y = legs.direction
    place_x = legs.start[:, None, None, 0] + driven * x[..., None]
    place_y = legs.start[:, None, None, 1] + driven * y[..., None]
    rest = quest.rest(place_x, place_y, figure_at <= landmark_at, view)
    return _Ways(length, at, rest)


def _swept(first: _Ways, then: _Ways, later: _Ways, quest: Quest, eagerness: float) -> Floats:
    """Ways (C, H) when a greedy sweep goes on after each candidate."""
    way = first.at[0] + first.rest[0]
    length = first.length[0] + _pause
    rows = np.arange(len(length))
    ahead, at_row, going = then, rows, np.ones(len(length), np.bool_)
    for _ in range(then.length.shape[1]):
        left = quest.weight * np.isinf(way)
        gain = np.einsum("cnh,ch->cn", np.isfinite(ahead.at)[at_row], left)
        chosen = np.argmax(gain / (ahead.length[at_row] + eagerness), axis=1)
        going = going & (gain[rows, chosen] > _least_share * left.sum(axis=1))
        if not going.any():
            break
        news = going[:, None] & np.isinf(way)
        step = length[:, None] + ahead.at[at_row, chosen] + ahead.rest[at_row, chosen]
        way = np.where(news, step, way)
        length += np.where(going, ahead.length[at_row, chosen] + _pause, 0.0)
        ahead, at_row = later, np.where(going, chosen, 0)
    return np.where(np.isinf(way), length[:, None] + _not_found, way)
