"""Three experts, who say what they would do in the learner's place.

`clairvoyant` is the paper's: it knows the map and takes the shortest path to the goal. It labels
what the learner cannot know, and it never searches, because it has nothing to search for; so
it teaches the learner nothing about where to look (Warrington et al., 2021). `detection_rate` knows
no more than the learner until the goal was detected, and takes what is most likely to show it for
the least way; from then on it is the first. `least_way` looks farther than the next look: it takes
what begins the least expected way to the goal over the learner's belief, and knows the map only
to tell a right stop from a wrong one. All are kept, to be compared.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from schemas.arrays import Flags, Floats
from schemas.belief import MapBelief
from schemas.geometry import Pose2
from services.policy.belief_features import names
from services.policy.candidates import Kind
from services.policy.cost import Circumstances
from services.policy.linear import ExpertName
from services.policy.policy import Memory, Proposal
from services.policy.rule import RateRule
from services.policy.training.truth import TrueWays

_onward = 1.1
"""Weight of the way from a candidate to the goal beside the way to the candidate."""
_standing_within = 1.45
"""The robot stands at the goal when it is this near [m]."""
_full_regret = 1.5
"""Way wasted for which an action is as wrong as any [m]."""
_full_share = 0.3
"""The same as a share of the best action's cost, where costs are not ways."""
_turning = 0.05
"""Way that is worth a turn: it takes time alone [m/rad]."""
_again = 2.0
"""Way that another look from the same place is not worth [m]."""
_wrong_stop = 8.0
"""Margin of a stop that is wrong: nothing can make up for it."""


@dataclass(frozen=True)
class Setting:
    """What one decision is about."""

    proposal: Proposal
    belief: MapBelief
    map_from_base: Pose2
    memory: Memory


@dataclass(frozen=True)
class Advice:
    """What an expert would do, and how bad everything else is."""

    label: int
    margin: Floats
    """(C,) l_xa of Eq. loss-augmentation, made to grow with the regret: 0 for the label, 1 for
    what is clearly worse, more for a wrong stop."""


class Expert(Protocol):
    """Somebody to learn from."""

    def advise(self, setting: Setting) -> Advice:
        """What to do there."""
        ...


class Clairvoyant:
    """Knows the true map: the candidate with the least |x - e| + 1.1 |e - g|, or stop at g."""

    def __init__(self, truth: TrueWays) -> None:
        self._truth = truth

    def advise(self, setting: Setting) -> Advice:
        """The shortest path."""
        candidates, pose = setting.proposal.candidates, setting.map_from_base
        stop = _stops(setting.proposal)
        if setting.proposal.here and self._truth.gap() <= _standing_within:
            return Advice(int(np.argmax(stop)), np.where(stop, 0.0, 1.0))
        ends = candidates.pose[:, :2]
        way = self._truth.from_robot(pose, ends) + _onward * self._truth.to_goal(pose, ends)
        # A way that only the true map rules out is as long as any.
        way = np.where(np.isfinite(way), way, 1e3)
        regret = way - way[~stop].min()
        return _advice(regret / _full_regret, stop)


class DetectionRate:
    """Searches on the learner's own belief until the goal is detected; then knows the map."""

    def __init__(self, truth: TrueWays, rule: RateRule) -> None:
        self._truth, self._rule = truth, rule
        self._knowing = Clairvoyant(truth)

    def advise(self, setting: Setting) -> Advice:
        """The best detection rate, or the shortest path."""
        seen = self._truth.is_detected(setting.belief, setting.map_from_base)
        standing = self._truth.gap() <= _standing_within
        # At the goal with nothing to declare, what is still to be confirmed has to be found.
        if seen and (setting.proposal.here or not standing):
            return self._knowing.advise(setting)
        return self._search(setting)

    def _search(self, setting: Setting) -> Advice:
        memory, stop = setting.memory, _stops(setting.proposal)
        # Patience is a setting of the policy and not something to learn.
        circumstances = Circumstances(memory.searching_s, memory.words, following=False)
        features = setting.proposal.features[:, : self._rule.moments]
        cost = self._rule.judge(features, circumstances).costs
        best = cost[~stop].min()
        return _advice((cost - best) / (_full_share * max(best, 1e-9)), stop)


class LeastWay:
    """Takes the least expected way to the goal, see `services.policy.search`, until it is there."""

    def __init__(self, truth: TrueWays) -> None:
        self._truth = truth

    def advise(self, setting: Setting) -> Advice:
        """What begins the best sweep over the hypotheses, or a stop that is right."""
        stop = _stops(setting.proposal)
        if setting.proposal.here and self._truth.gap() <= _standing_within:
            return Advice(int(np.argmax(stop)), np.where(stop, 0.0, 1.0))
        mean = setting.proposal.features[:, 0]
        tried, found = mean[:, names.index("tried")], mean[:, names.index("reach_found")]
        # A thing that was found is gone to, however often one was near it.
        way = mean[:, names.index("way")] + _again * tried * (1 - found)
        way = way + _turning * mean[:, names.index("turn")]
        return _advice((way - way[~stop].min()) / _full_regret, stop)


def make_expert(name: ExpertName, truth: TrueWays, rule: RateRule) -> Expert:
    """The expert of that name in one world."""
    if name == "clairvoyant":
        return Clairvoyant(truth)
    return LeastWay(truth) if name == "least_way" else DetectionRate(truth, rule)


def _advice(regret: Floats, stop: Flags) -> Advice:
    """Of the move with the least regret, which is 0 for it and 1 for a move as bad as any."""
    margin = np.where(stop, _wrong_stop, np.clip(regret, 0.0, 1.0))
    label = int(np.argmin(margin))
    return Advice(label, margin)


def _stops(proposal: Proposal) -> Flags:
    return np.array([kind is Kind.STOP for kind in proposal.candidates.kinds], np.bool_)
