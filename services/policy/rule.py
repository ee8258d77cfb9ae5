"""What each candidate costs.

This first form is a rule set by hand, not a learned policy: the expected metres per useful sight,

    cost(a) = (start + length + turn) / gain,   gain = w_1 . Phi_1 + w_2 . Phi_2

so the lowest cost is the highest detection rate, 0.5 P(see f) + 0.5 P(see f or l) over the way,
with small terms for ground that nobody has looked at. The gain is linear in the moments of
Eq. policy-decomposition; the quotient and the gate on stop are not part of the paper's linear
cost (Eq. belief-policy-vector), which replaces this module once its weights are learned.
"""

from collections.abc import Mapping
from importlib import resources

import msgspec
import numpy as np
from msgspec import Struct

from schemas.arrays import Floats
from services.policy.belief_features import names
from services.policy.cost import Circumstances, Judgement

_moments = 2
_keep = 0.8
"""Cost factor of what is being followed, against dithering."""
_hopeless = 1e4
"""Cost of a stop that is not confirmed: finite, and more than anything else costs [m]."""


class UnknownFeatureError(ValueError):
    """Weights name a feature that does not exist; the message lists those that do."""


class RateRule(Struct, frozen=True, kw_only=True):
    """Weights of one robot's policy."""

    source: str
    """Where the numbers come from."""
    mean: Mapping[str, float]
    """Gain per unit of the first moment, by feature name."""
    variance: Mapping[str, float]
    """Likewise of the second moment."""
    start_m: float
    """Added to every way: stopping and looking take time too [m]."""
    turn_m_per_rad: float
    """[m/rad]"""
    tried_factor: float
    """What another look from the same place is worth, of the look before."""
    least_gain: float
    """Candidates that promise less are not worth their way."""
    confirmed: float
    """Probability that the seen thing is meant from which on it is the goal."""
    confirmed_late: float
    """The same after a search that took long: what was not found by then is less likely to be
    there than the filter's prior says, which knows no end of the world."""
    late_s: tuple[float, float]
    """When the one begins to turn into the other, and when it has [s]."""
    confirmed_still: float
    """What was the goal remains it down to this, so that a small doubt on the way to it, as of
    where one room ends and another begins, starts no new search."""

    def gate(self, circumstances: Circumstances) -> float:
        """Probability from which on the seen thing that is likeliest to be meant is the goal."""
        ends = (self.confirmed, self.confirmed_late)
        gate = float(np.interp(circumstances.searching_s, self.late_s, ends))
        return min(gate, self.confirmed_still) if circumstances.settled else gate

    @property
    def moments(self) -> int:
        """K."""
        return _moments

    def judge(self, features: Floats, circumstances: Circumstances) -> Judgement:
        """Judge candidates with features (C, K, D), with some patience for what is followed."""
        gate = self.gate(circumstances)
        gains, costs = self.gains(features, gate), self.costs(features, gate)
        costs[1 : 1 + circumstances.following] *= _keep
        return Judgement(costs, gains, (gains >= self.least_gain) & (costs < _hopeless))

    def gains(self, features: Floats, gate: float) -> Floats:
        """Worth (C,) of candidates with features (C, K, D), in [0, 1] about; see `gate`."""
        weights = np.stack([_vector(self.mean), _vector(self.variance)])[:_moments]
        gain = np.einsum("ckd,kd->c", features, weights)
        gain = gain * self.tried_factor ** _mean(features, "tried")
        return np.where(_mean(features, "reach_found") >= gate, 1.0, gain)

    def costs(self, features: Floats, gate: float) -> Floats:
        """Cost (C,) of candidates with features (C, K, D), finite, in metres to go; see `gate`."""
        turning = self.turn_m_per_rad * _mean(features, "turn")
        effort = self.start_m + _mean(features, "length") + turning
        cost = effort / np.maximum(self.gains(features, gate), self.least_gain)
        may_stop = (_mean(features, "reach_found") >= gate) & (_mean(features, "here") > 0)
        is_stop = _mean(features, "is_stop") > 0
        return np.where(is_stop, np.where(may_stop, 0.0, _hopeless), np.minimum(cost, _hopeless))


def load_rule(robot: str) -> RateRule:
    """Weights of a robot by name.

    Raises:
        FileNotFoundError: there are none for it.
        UnknownFeatureError: they name a feature that is not in `belief_features.names`.
    """
    file = resources.files("services.policy") / "weights" / f"{robot}.json"
    rule = msgspec.json.decode(file.read_bytes(), type=RateRule)
    unknown = sorted({*rule.mean, *rule.variance} - set(names))
    if unknown:
        raise UnknownFeatureError(f"unknown features {unknown}; features are: {', '.join(names)}")
    return rule


def _vector(weights: Mapping[str, float]) -> Floats:
    return np.array([weights.get(name, 0.0) for name in names])


def _mean(features: Floats, name: str) -> Floats:
    return features[:, 0, names.index(name)]
