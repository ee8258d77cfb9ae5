"""The learned cost: linear in the moments of the features (Eq. belief-policy-vector).

    cost(a) = W^T F_a,   W one of several by the kind of words, F_a standardised

Moving and stopping have weights of their own, which is the same as features that are multiplied by
1[move] and 1[stop]. A stop is possible only where the robot stands at something that was seen:
there is nothing else that it could declare found. Weights come from `services.policy.training`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Literal, cast

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from schemas.arrays import Flags, Floats, Ints
from schemas.errors import UserError
from services.policy.belief_features import names
from services.policy.cost import Circumstances, Judgement, Words

ExpertName = Literal["least_way", "detection_rate", "clairvoyant"]
"""Whom the weights were learned from, see `training.experts`."""
default_expert: ExpertName = "least_way"

BLOCKS = ("move", "stop")
_promises = {"see_either": 1.0, "reach": 1.0, "new_area": 0.03}
"""What makes a move worth doing, by feature, and how much of it."""
_fading = 0.3
"""What another look from the same place promises, of the look before."""
_least_promise = 0.005
_widest = 6.0
"""Standardised features count for no more: what is rare must not decide alone."""
_dearer = 10.0
"""What a candidate that is not worth doing costs more than the dearest, so that it is chosen only
where there is nothing else."""

ByFeature = Mapping[str, tuple[float, ...]]
"""K numbers for each feature."""


class WeightsError(UserError):
    """Weights do not go with the features that exist; the message says which."""


class Provenance(Struct, frozen=True, kw_only=True):
    """Where weights come from."""

    git: str
    seed: int
    expert: ExpertName
    rounds: int
    """Rounds of data that they were fitted to."""
    decisions: int
    """Of them."""
    agreement: float
    """Share of decisions on validation worlds that are the expert's."""
    success: float
    """Share of validation episodes that ended at what was meant."""


class Block(Struct, frozen=True, kw_only=True):
    """How the features of moves, or of stops, are standardised, and their weights."""

    mean: ByFeature
    deviation: ByFeature
    weights: dict[Words, ByFeature]


class LinearWeights(Struct, frozen=True, kw_only=True):
    """One robot's learned policy, as it stands in its file."""

    provenance: Provenance
    moments: int
    """K"""
    patience: float
    """By how much the candidate that is being followed is cheaper, against dithering; the
    margin of the training is 1."""
    confirmed: float
    """Probability from which on a seen thing is the goal, so that a decision is due at once."""
    confirmed_late: float
    """The same after a search that took long: what was not found by then is less likely to be
    there than the filter's prior says, which knows no end of the world."""
    late_s: tuple[float, float]
    """When the one begins to turn into the other, and when it has [s]."""
    confirmed_still: float
    """What was the goal remains it down to this, so that a small doubt on the way to it, as of
    where one room ends and another begins, starts no new search."""
    stop_above: float
    """Chance constraint: no stop below this posterior; 0 leaves it all to the weights."""
    move: Block
    stop: Block


@dataclass(frozen=True)
class LinearCost:
    """A cost as arrays.

    Args:
        columns: (D',) rows of `belief_features.names` that are read.
        mean, deviation: (2, K, D') of moves and stops.
        weights: (2, K, D') by the kind of words; "any" is always there.
        settings: the numbers that were not learned.
    """

    columns: Ints
    mean: Floats
    deviation: Floats
    weights: Mapping[Words, Floats]
    settings: LinearWeights

    @property
    def moments(self) -> int:
        """K."""
        return self.mean.shape[1]

    def gate(self, circumstances: Circumstances) -> float:
        """Probability from which on the seen thing that is likeliest to be meant is the goal."""
        ends = (self.settings.confirmed, self.settings.confirmed_late)
        gate = float(np.interp(circumstances.searching_s, self.settings.late_s, ends))
        return min(gate, self.settings.confirmed_still) if circumstances.settled else gate

    def judge(self, features: Floats, circumstances: Circumstances) -> Judgement:
        """Judge candidates with features (C, K or more, D)."""
        is_stop = stops(features)
        costs = self.costs(features, circumstances.words)
        costs[1 : 1 + circumstances.following] -= self.settings.patience
        found, here = _first(features, "reach_found"), _first(features, "here") > 0
        promise = sum(share * _first(features, name) for name, share in _promises.items())
        # A place that was tried often is left, whatever the weights say.
        promise = promise * _fading ** _first(features, "tried")
        gains = np.clip(np.where(is_stop, found, promise), 0.0, 1.0)
        may_stop = here & (found >= self.settings.stop_above)
        worthwhile: Flags = np.where(is_stop, may_stop, gains >= _least_promise)
        # What was confirmed is the goal: it is declared, or gone to, before all else.
        gate = self.gate(circumstances)
        sure = np.where(is_stop, may_stop, True) & (found >= gate)
        for due in (sure & is_stop, sure):
            if due.any():
                worthwhile = due
                break
        dearest = costs.max() + _dearer
        return Judgement(np.where(worthwhile, costs, dearest + is_stop), gains, worthwhile)

    def costs(self, features: Floats, words: Words) -> Floats:
        """W^T F (C,) of features (C, K or more, D), before what is not learned."""
        is_stop = stops(features)
        own = features[:, : self.moments, self.columns]
        standard = standardised(own, is_stop, self.mean, self.deviation)
        weights = self.weights.get(words, self.weights["any"])
        return np.einsum("ckd,ckd->c", standard, weights[is_stop.astype(np.intp)])


def standardised(
    features: NDArray[np.floating], is_stop: Flags, mean: Floats, deviation: Floats
) -> Floats:
    """Features (C, K, D) of one decision as deviations from the mean, within limits.

    Late in a long search every way is longer than any that was learned from. What is common to all
    moves is limited apart from what sets them off against one another: else they came out alike.

    Args:
        features: of C candidates.
        is_stop: (C,)
        mean: (2, K, D) of moves and stops.
        deviation: likewise.
    """
    block = is_stop.astype(np.intp)
    standard = (features - mean[block]) / deviation[block]
    if is_stop.all():
        return np.clip(standard, -_widest, _widest)
    common = np.median(standard[~is_stop], axis=0) * ~is_stop[:, None, None]
    limited = [np.clip(part, -_widest, _widest) for part in (common, standard - common)]
    return limited[0] + limited[1]


def stops(features: NDArray[np.floating]) -> Flags:
    """Which of the candidates (C,) with features (C, K, D) are stops."""
    return features[:, 0, names.index("is_stop")] > 0


def _first(features: Floats, name: str) -> Floats:
    return features[:, 0, names.index(name)]


def cost_of(weights: LinearWeights) -> LinearCost:
    """The cost that weights describe. Features that they do not name have no weight.

    Raises:
        WeightsError: they name features that do not exist, or lack some of their own numbers.
    """
    named = tuple(weights.move.mean)
    unknown = sorted(set(named) - set(names))
    if unknown:
        raise WeightsError(
            f"weights name unknown features {', '.join(unknown)}; features are: "
            f"{', '.join(names)}; 'incognita train policy' makes weights for these"
        )
    blocks = (weights.move, weights.stop)
    if not all("any" in block.weights for block in blocks):
        raise WeightsError('weights lack those for "any" words')
    kinds: list[Words] = [kind for kind in blocks[0].weights if kind in blocks[1].weights]
    return LinearCost(
        columns=np.array([names.index(name) for name in named], np.int32),
        mean=_stacked([block.mean for block in blocks], named, weights.moments),
        deviation=_stacked([block.deviation for block in blocks], named, weights.moments),
        weights={
            kind: _stacked([block.weights[kind] for block in blocks], named, weights.moments)
            for kind in kinds
        },
        settings=weights,
    )


def _stacked(tables: list[ByFeature], named: tuple[str, ...], moments: int) -> Floats:
    """Shape (2, K, D') of a table for each block."""
    for table in tables:
        wrong = sorted(set(table) ^ set(named))
        wrong += [name for name, numbers in table.items() if len(numbers) != moments]
        if wrong:
            raise WeightsError(f"weights do not have {moments} numbers each for {', '.join(wrong)}")
    return np.array([[table[name] for name in named] for table in tables]).transpose(0, 2, 1)


def by_feature(values: Floats, named: tuple[str, ...]) -> ByFeature:
    """The inverse for one block (K, D'), rounded for people."""
    return {
        name: tuple(float(f"{value:.6g}") for value in column)
        for name, column in zip(named, values.T.tolist(), strict=True)
    }


def weights_path(robot: str, expert: ExpertName) -> Path:
    """Where the weights of a robot are kept."""
    folder = cast(Path, resources.files("services.policy")) / "weights"
    return folder / f"{robot}.{expert}.json"


def load_linear(path: Path) -> LinearCost:
    """The cost that a file describes.

    Raises:
        WeightsError: it is no such file, or does not go with the features that exist.
    """
    try:
        weights = msgspec.json.decode(path.read_bytes(), type=LinearWeights)
    except msgspec.DecodeError as error:
        raise WeightsError(f"{path} holds no weights of a policy: {error}") from error
    return cost_of(weights)


def save_linear(path: Path, weights: LinearWeights) -> None:
    """Write weights for people and for `load_linear`."""
    text = msgspec.json.format(msgspec.json.encode(weights), indent=1)
    path.write_bytes(text + b"\n")
