"""The policy: the cheapest of all candidates, over all hypotheses (Eq. policy)."""

from dataclasses import dataclass, replace

import numpy as np

from robots.spec import RobotSpec
from schemas.arrays import Flags, Floats, Ints
from schemas.belief import MapBelief, OccupancyGrid, first_topology
from schemas.geometry import Pose2, wrap_angle
from services.policy import candidates as candidates_of
from services.policy import places
from services.policy.belief_features import Situation, belief_features
from services.policy.candidates import Candidates, Kind
from services.policy.cost import Circumstances, Cost, Words
from services.policy.referents import (
    Referents,
    at_their_boxes,
    best_found,
    mass_of,
    place_of,
    same_place,
    seen_figures,
)
from services.policy.search import places_to_look
from services.policy.standing import Standing
from services.policy.terrain import Terrain, terrain_for
from services.policy.travel import travel_from
from services.policy.view import FieldOfView

_shortest_move = 0.7
"""Shorter moves show nothing new and would freeze the robot [m]."""
_smallest_turn = np.radians(20.0)
_refused_within = 0.7
_in_the_middle = 0.5
"""This near to the free middle of a place one is there [m]."""
_well_inside, _same_spot = 1.5, 0.3
_passing_m = 1.2
_long_s = 1e4
"""By then any search has become a long one [s]."""
_footprint_margin = 0.05
_turning_margin = 0.15
"""Of the footprint's circle where the base is to turn on the spot [m]."""
_ways_to_a_thing = 3
"""Approaches kept for each seen thing, the nearest of those that can be reached."""


@dataclass(frozen=True)
class Memory:
    """What earlier decisions left behind."""

    refused: Floats
    """(R, 2) Places that could not be reached, map frame [m]."""
    tried: Floats
    """(T, 3) Poses from which the robot looked on purpose."""
    current: Candidates | None
    """The candidate that is being followed."""
    searching_s: float
    """How long the search has taken [s]."""
    words: Words = "any"
    """What kind of landmark the instruction names."""
    wanted: str = ""
    """Class of the figure, "" where it is not known."""
    inside: str = ""
    """Class of the thing that the figure lies in, "" where the instruction names none."""
    settled: Floats | None = None
    """(2,) Where the goal of the last decision was, map frame [m]; None where it had none."""


@dataclass(frozen=True)
class Proposal:
    """Everything that could be done now, and what is believed of it."""

    candidates: Candidates
    """The stop action first, then what is being followed, then all others."""
    features: Floats
    """(C, K, D), see `belief_features`."""
    following: bool
    """Whether row 1 is the candidate that is being followed."""
    here: float
    """1 where the robot stands at what it would declare found."""


@dataclass(frozen=True)
class Choice:
    """One decision."""

    candidates: Candidates
    costs: Floats
    """(C,) [m]"""
    gains: Floats
    """(C,) What each is worth."""
    chosen: int
    confirmed: float
    """Posterior mass that the robot stands at the thing that was meant, and all is seen."""
    kept: bool
    """Whether the choice is the candidate that was being followed."""

    is_idle: bool
    """Whether not even the best is worth doing: there is nothing left to look at."""

    @property
    def kind(self) -> Kind:
        """Of what was chosen."""
        return self.candidates.kinds[self.chosen]

    @property
    def confirms(self) -> bool:
        """Whether the choice is to declare that the goal was reached."""
        return self.kind is Kind.STOP and not self.is_idle


class BeliefPolicy:
    """pi(x, p(S)): what to do next.

    Args:
        spec: the robot, for its camera and size.
        cost: of candidates.
    """

    def __init__(self, spec: RobotSpec, cost: Cost) -> None:
        self.cost = cost
        self._locations = spec.symbols.locations
        self._containers = spec.symbols.containers
        self._turning_radius = spec.base.radius + _turning_margin
        self._radius = spec.base.passage_radius + _footprint_margin
        self._view = FieldOfView.of(spec.camera)
        self.standing = Standing.of(spec)

    def decide(
        self,
        belief: MapBelief,
        referents: Referents,
        grid: OccupancyGrid,
        map_from_base: Pose2,
        memory: Memory,
    ) -> Choice:
        """Propose, judge by the belief, take the cheapest."""
        proposal = self.propose(belief, referents, grid, map_from_base, memory)
        return self.choose(proposal, referents, memory)

    def propose(
        self,
        belief: MapBelief,
        referents: Referents,
        grid: OccupancyGrid,
        map_from_base: Pose2,
        memory: Memory,
    ) -> Proposal:
        """The action set and its features."""
        situation = self._situation(grid, map_from_base, memory)
        aims = self._aims(referents, memory)
        proposed = self._proposed(belief, aims, situation, map_from_base, memory)
        proposed = _looked_into(proposed, seen_figures(referents))
        proposed = proposed.take(_worthwhile(proposed, situation, memory))
        stop = candidates_of.stop_at(map_from_base, best_found(referents))
        following = _still_reachable(memory.current, situation)
        candidates = candidates_of.joined([stop, *following, proposed])
        here = np.zeros(len(candidates))
        at = int(stop.object_id[0])
        here[0] = self._stands_at(belief, at, situation, map_from_base, memory.refused)
        features = belief_features(situation, candidates, here, aims, self.cost.moments)
        return Proposal(candidates, features, bool(following), float(here[0]))

    def choose(self, proposal: Proposal, referents: Referents, memory: Memory) -> Choice:
        """The cheapest (Eq. policy).

        Where nothing is left to look at, the search has come to where a long one ends: what was
        found is the goal if it would be then.
        """
        choice = self._cheapest(proposal, referents, memory)
        if not choice.is_idle:
            return choice
        return self._cheapest(proposal, referents, replace(memory, searching_s=_long_s))

    def _cheapest(self, proposal: Proposal, referents: Referents, memory: Memory) -> Choice:
        candidates = proposal.candidates
        goal = self.goal_of(referents, memory)
        # What was followed before it was known what is meant deserves no patience.
        following = proposal.following and goal in (None, candidates.object_id[1])
        circumstances = _circumstances(referents, memory, best_found(referents), following)
        judged = self.cost.judge(proposal.features, circumstances)
        chosen = int(np.argmin(judged.costs))
        return Choice(
            candidates=candidates,
            costs=judged.costs,
            gains=judged.gains,
            chosen=chosen,
            confirmed=proposal.here * mass_of(referents, int(candidates.object_id[0])),
            kept=proposal.following and chosen == 1,
            is_idle=not bool(judged.worthwhile[chosen]),
        )

    def passing_m(self, wanted: str) -> float:
        """How near to a place to look from the next one is chosen [m]; 0 is on arrival.

        Rooms are looked into on the way; a thing is looked for from where one stands.
        """
        return _passing_m if wanted in self._locations else 0.0

    def goal_of(self, referents: Referents, memory: Memory) -> int | None:
        """Seen object that is meant beyond the doubt allowed now, or None."""
        best = best_found(referents)
        gate = self.cost.gate(_circumstances(referents, memory, best, following=False))
        return best if mass_of(referents, best) >= gate else None

    def _situation(self, grid: OccupancyGrid, pose: Pose2, memory: Memory) -> Situation:
        terrain = terrain_for(grid, self._radius)
        start = np.array([pose.x, pose.y])
        travel = travel_from(terrain, start, self._radius)
        return Situation(
            np.array([pose.x, pose.y, pose.yaw]), terrain, travel, self._view, memory.tried
        )

    def _proposed(
        self,
        belief: MapBelief,
        referents: Referents,
        situation: Situation,
        pose: Pose2,
        memory: Memory,
    ) -> Candidates:
        parts = [self._unseen(situation.terrain, belief, pose, memory.wanted)]
        if self._view.half_angle < np.pi:
            parts.append(places.turns(pose))
        parts += places.views_of(places.hypotheses(referents), pose, self._view.range_max)
        looks = places_to_look(referents, self._view, situation.terrain)
        parts.append(places.standing_at(looks, pose))
        parts += [
            self._ways_to(belief, one, situation, pose, memory.refused)
            for one in seen_figures(referents)
        ]
        return candidates_of.joined(parts)

    def _aims(self, referents: Referents, memory: Memory) -> Referents:
        """What to look for: where the figure lies in a thing, that thing."""
        return at_their_boxes(referents) if memory.inside in self._containers else referents

    def _unseen(self, terrain: Terrain, belief: MapBelief, pose: Pose2, wanted: str) -> Candidates:
        """Where to go for things nobody saw: a place lies beyond the measured ground."""
        if wanted in self._locations:
            return places.openings(terrain, pose, self._radius, self._turning_radius)
        return places.frontiers(terrain, pose, belief.viewer)

    def _ways_to(
        self,
        belief: MapBelief,
        object_id: int,
        situation: Situation,
        pose: Pose2,
        refused: Floats,
    ) -> Candidates:
        """Into a place, or up to a thing."""
        row = _row_of(belief, object_id)
        center = belief.position[row]
        if self._is_place(belief, row):
            return places.inside(center, object_id, situation.terrain, self._turning_radius, pose)
        center, radius = self.standing.around(belief, row)
        ways = places.approaches(center, radius, object_id, pose, self.standing.gap)
        if self._containers:
            # An arm that reached nothing from one side may reach it from another.
            ways = ways.take(np.flatnonzero(~_is_refused(ways, refused)).astype(np.int32))
        return _nearest_ways(ways, situation, self._radius)

    def _is_place(self, belief: MapBelief, row: int) -> bool:
        return belief.classes[belief.class_index[row]] in self._locations

    def _stands_at(
        self,
        belief: MapBelief,
        object_id: int,
        situation: Situation,
        pose: Pose2,
        refused: Floats,
    ) -> bool:
        if object_id < 0:
            return False
        row = _row_of(belief, object_id)
        if self._is_place(belief, row):
            spot = self._ways_to(belief, object_id, situation, pose, refused).pose[0]
            gap = float(np.hypot(*(spot[:2] - (pose.x, pose.y))))
            came = np.hypot(*(situation.tried[:, :2] - (pose.x, pose.y)).T) < _same_spot
            # The middle moves while more of a place is seen: who came to it once has come.
            arrived = bool(came.any()) and gap <= _well_inside and _is_in(belief, row)
            return gap <= _in_the_middle or arrived
        return self.standing.is_at(belief, row, pose, refused)


def _circumstances(
    referents: Referents, memory: Memory, best: int, following: bool
) -> Circumstances:
    """Of a decision where a seen object `best` is the likeliest to be meant."""
    settled = False
    if memory.settled is not None and best >= 0:
        gap = float(np.hypot(*(place_of(referents, best) - memory.settled)))
        settled = gap < same_place
    return Circumstances(memory.searching_s, memory.words, following, settled)


def _is_in(belief: MapBelief, row: int) -> bool:
    """Whether the last pose node lies in a region, by its row."""
    topology = first_topology - int(belief.particle[row])
    if not 0 <= topology < len(belief.node_regions):
        return False
    regions = belief.node_regions[topology]
    return len(regions) > 0 and bool(regions[-1] == belief.node[row])


def _row_of(belief: MapBelief, object_id: int) -> int:
    return int(np.flatnonzero(belief.seen & (belief.node == object_id))[0])


def _nearest_ways(ways: Candidates, situation: Situation, radius: float) -> Candidates:
    distance = situation.travel.to(ways.pose[:, :2])
    narrow = situation.terrain.clearance_at(ways.pose[:, :2]) < radius
    # A narrow place is kept in reserve: blocks are coarse, and the planner knows better.
    order = np.argsort(distance + 100.0 * narrow, kind="stable")
    return ways.take(order[:_ways_to_a_thing].astype(np.int32))


def _still_reachable(current: Candidates | None, situation: Situation) -> list[Candidates]:
    if current is None or not np.isfinite(situation.travel.to(current.pose[:, :2])).all():
        return []
    return [current]


def _worthwhile(proposed: Candidates, situation: Situation, memory: Memory) -> Ints:
    """Rows that can be reached, were not refused, and are not where the robot is already."""
    reachable = np.isfinite(situation.travel.to(proposed.pose[:, :2]))
    refused = _is_refused(proposed, memory.refused)
    kept = reachable & ~refused & _is_a_move(proposed, situation.pose)
    return np.flatnonzero(kept).astype(np.int32)


def _is_refused(proposed: Candidates, refused: Floats) -> Flags:
    """(C,) Which candidates stand near to one of the places (R, 2) that did not do."""
    offset = proposed.pose[:, None, :2] - refused
    near: Flags = np.any(np.hypot(offset[..., 0], offset[..., 1]) < _refused_within, axis=1)
    return near


def _looked_into(proposed: Candidates, seen: list[int]) -> Candidates:
    """The same, where one looks into seen things that are none of the seen figures themselves."""
    kinds = tuple(
        Kind.INSIDE if kind is Kind.OBSERVED and number not in seen else kind
        for kind, number in zip(proposed.kinds, proposed.object_id.tolist(), strict=True)
    )
    return replace(proposed, kinds=kinds)


def _is_a_move(proposed: Candidates, pose: Floats) -> Flags:
    moved = np.hypot(*(proposed.pose[:, :2] - pose[:2]).T)
    turned = np.array([abs(wrap_angle(yaw)) for yaw in (proposed.pose[:, 2] - pose[2]).tolist()])
    on_the_spot = (moved < 1e-6) & (turned > _smallest_turn)
    observed = np.array([kind in (Kind.OBSERVED, Kind.INSIDE) for kind in proposed.kinds])
    return (moved > _shortest_move) | on_the_spot | observed
