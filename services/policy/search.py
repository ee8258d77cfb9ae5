"""How far it is to the goal in each hypothesis, if a candidate is taken first.

The robot does not know which hypothesis holds, so the way to a thing that nobody saw yet leads
over places that turn out to be empty. What follows after the candidate is a sweep over few places
that together show all that is left. Until something comes into view all hypotheses share this
sweep; from then on each is taken to be known (the figure is where it says). The first moment of the
result is the expected way of the best sweep that begins with the candidate, which a rule that only
weighs the next look against its way cannot see. Expected is what the way is as a multiple of the
shortest one, see `Referents.stake`. Sweeps are found by beam search, in which every
candidate keeps its own best beginning.
"""

from dataclasses import dataclass

import numpy as np

from schemas.arrays import Flags, Floats, Ints
from services.policy.candidates import Candidates
from services.policy.places import stand_off
from services.policy.referents import Referents
from services.policy.sight import Legs, distances, shown_from
from services.policy.terrain import Terrain
from services.policy.view import FieldOfView

_looks = 16
"""Places that a sweep goes over, at most."""
_width = 24
"""Sweeps kept beside the best one of each candidate."""
_least_share = 0.01
_not_found = 15.0
"""Detour to what the sweep does not show, beside the straight way from its end [m]."""
_pause = 1.0
"""Every move costs a look and a decision, worth this much of way [m]."""
_exhausted = 0.005
"""Where a thing would have been missed with less than this probability, it was looked for as well
as can be: who misses it there once more misses it always."""
_overlap = 0.8
"""Looks are this share of the reach apart, so that no gaps are left between them."""


@dataclass(frozen=True)
class Quest:
    """What is left to be seen, in H hypotheses."""

    weight: Floats
    """(H,) Probability by what is at stake; sums to one."""
    figure: Floats
    """(H, 2), map frame [m]"""
    landmark: Floats
    """(H, 2), map frame [m]"""
    landmark_seen: Flags
    """(H,)"""
    shows_figure: Flags
    """(H,) Whether a look at its place can show the figure for the first time."""
    shows_landmark: Flags
    """(H,)"""

    def resolved(self, figure_at: Floats, landmark_at: Floats) -> Floats:
        """How far along (..., H) something new comes into view, by when each thing does."""
        figure = np.where(self.shows_figure, figure_at, np.inf)
        return np.minimum(figure, np.where(self.shows_landmark, landmark_at, np.inf))

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
    pose: Floats,
    lengths: Floats,
    candidates: Candidates,
    referents: Referents,
    view: FieldOfView,
    terrain: Terrain,
) -> Floats:
    """Way (C, M) [m] to the figure of each reading, if each candidate is taken first.

    Args:
        pose: (3,) x, y, yaw of the base, map frame.
        lengths: (C,) of the ways to the candidates, round obstacles [m].
        candidates: C of them.
        referents: M readings.
        view: how far and how wide the robot sees.
        terrain: where it has looked.
    """
    own = (candidates.object_id[:, None] == referents.figure_id) & referents.figure_seen
    rest = distances(candidates.pose[:, :2], referents.figure)
    ways = lengths[:, None] + np.where(own, 0.0, _last_leg(rest))
    pending, quest = _quest(referents, terrain)
    if len(pending):
        ways[:, pending] = _planned(pose, lengths, candidates, quest, view)
    counted = referents.found.copy()
    counted[pending] = True
    expected = ways[:, counted] @ _share((referents.probability * referents.stake)[counted])
    # What no hypothesis explains, and no look can show, is no reason to prefer one candidate.
    return np.where(counted, ways, expected[:, None])


def places_to_look(referents: Referents, view: FieldOfView, terrain: Terrain) -> Floats:
    """Few places (N, 2) that together show everything that is left to see."""
    pending, quest = _quest(referents, terrain)
    return _cover(quest, view) if len(pending) else np.zeros((0, 2))


def _last_leg(distance: Floats) -> Floats:
    """Way to a thing at a distance, which is yet another move [m]."""
    return np.maximum(distance - stand_off, 0.0) + _pause


def _share(weight: Floats) -> Floats:
    return weight / max(float(weight.sum()), 1e-12)


def _quest(referents: Referents, terrain: Terrain) -> tuple[Ints, Quest]:
    """Rows of the readings in which something is left to see, and these as a quest."""
    figure = ~referents.figure_seen & (terrain.missed_at(referents.figure) > _exhausted)
    landmark = ~referents.landmark_seen & (terrain.missed_at(referents.landmark) > _exhausted)
    rows = np.flatnonzero(referents.known & (figure | landmark)).astype(np.int32)
    # Ties are broken by place, so that the order of the hypotheses means nothing.
    keys = np.concatenate([referents.figure[rows].T, referents.landmark[rows].T])
    rows = rows[np.lexsort(keys)]
    quest = Quest(
        weight=_share((referents.probability * referents.stake)[rows]),
        figure=referents.figure[rows],
        landmark=referents.landmark[rows],
        landmark_seen=referents.landmark_seen[rows],
        shows_figure=figure[rows],
        shows_landmark=landmark[rows],
    )
    return rows, quest


def _planned(
    pose: Floats, lengths: Floats, candidates: Candidates, quest: Quest, view: FieldOfView
) -> Floats:
    """Ways (C, H) of the best sweep after each candidate."""
    looks = _cover(quest, view)
    first = _Table.of(
        _to_candidates(pose, lengths, candidates, quest, view), candidates.pose, quest
    )
    table = _Table.of(_between(candidates.pose[:, :2], looks, quest, view), looks, quest)
    later = _Table.of(_between(looks, looks, quest, view), looks, quest)
    sweeps = _Sweeps.begun(first)
    ways = sweeps.way.copy()
    for _ in range(len(looks)):
        sweeps, table = sweeps.extended(table, quest.weight), later
        if not len(sweeps.first):
            break
        rows = _best_of_each(sweeps.first, sweeps.way @ quest.weight)
        # Longer sweeps guess less.
        ways[sweeps.first[rows]] = sweeps.way[rows]
    return ways


@dataclass(frozen=True)
class _Table:
    """What looks from B places after ways from A places bring."""

    length: Floats
    """(A, B) with the pause after it [m]."""
    shows: Flags
    """(A, B, H) where something new comes into view."""
    way: Floats
    """(A, B, H) to the figure: the true one where something does, else a guess [m]."""

    @staticmethod
    def of(ways: _Ways, ends: Floats, quest: Quest) -> "_Table":
        length, shows = ways.length + _pause, np.isfinite(ways.at)
        guess = length[..., None] + distances(ends[:, :2], quest.figure) + _not_found
        return _Table(length, shows, np.where(shows, ways.at + ways.rest, guess))


@dataclass(frozen=True)
class _Sweeps:
    """S beginnings of sweeps, all with as many looks."""

    first: Ints
    """(S,) candidate that each began with."""
    place: Ints
    """(S,) where each has got to: a row of the next table."""
    length: Floats
    """(S,) of the way so far [m]."""
    pending: Flags
    """(S, H) where nothing came into view yet."""
    way: Floats
    """(S, H) to the figure, a guess where pending [m]."""

    @staticmethod
    def begun(first: _Table) -> "_Sweeps":
        """One with each candidate."""
        rows = np.arange(first.length.shape[1], dtype=np.int32)
        return _Sweeps(rows, rows, first.length[0], ~first.shows[0], first.way[0])

    def extended(self, table: _Table, weight: Floats) -> "_Sweeps":
        """The best of all sweeps that go on to one more look."""
        left = self.pending * weight
        shown = np.einsum("sh,snh->sn", left, table.shows[self.place])
        score = np.einsum("sh,snh->sn", left, table.way[self.place])
        score += ((~self.pending * self.way) @ weight + left.sum(axis=1) * self.length)[:, None]
        useful = shown > _least_share * left.sum(axis=1)[:, None]
        sweep, look = self._best(np.where(useful, score, np.inf))
        place, length = self.place[sweep], self.length[sweep]
        way = np.where(
            self.pending[sweep], length[:, None] + table.way[place, look], self.way[sweep]
        )
        return _Sweeps(
            first=self.first[sweep],
            place=look,
            length=length + table.length[place, look],
            pending=self.pending[sweep] & ~table.shows[place, look],
            way=way,
        )

    def _best(self, score: Floats) -> tuple[Ints, Ints]:
        """Sweep and look (S',) of the least scores (S, N): of all, and of each candidate."""
        looks = score.shape[1]
        order = np.argsort(score, axis=None, kind="stable")
        order = order[: np.isfinite(score).sum()].astype(np.int32)
        own = _best_of_each(self.first[order // looks], np.arange(len(order), dtype=np.int32))
        kept = order[np.union1d(own, np.arange(min(_width, len(order))))]
        return kept // np.int32(looks), kept % np.int32(looks)


def _best_of_each(owner: Ints, score: Floats | Ints) -> Ints:
    """Row with the least score of each owner among (S,)."""
    order = np.lexsort((score, owner))
    _, first = np.unique(owner[order], return_index=True)
    return order[first].astype(np.int32)


def _cover(quest: Quest, view: FieldOfView) -> Floats:
    """Places (N, 2), the one that shows most of what the ones before did not show first."""
    figure, landmark = quest.shows_figure, quest.shows_landmark
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
