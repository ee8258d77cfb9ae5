"""From labelled decisions to the weights of a policy: standardise, then fit each kind of words."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np

from schemas.arrays import Floats
from services.policy.belief_features import names
from services.policy.cost import Words
from services.policy.linear import Block, LinearWeights, Provenance, by_feature, standardised, stops
from services.policy.training.collect import Decision
from services.policy.training.fit import FitSettings, State, agreement, fit, mean_loss

_patience = 1.0
_confirmed, _confirmed_late = 0.9, 0.6
_late_s = (60.0, 150.0)
_stop_above = 0.6
_least_deviation = 1e-3
"""Of a feature that hardly ever differs: rare values must not become huge."""
_constant = 1e-6
_least_decisions = 50
"""Kinds of words with fewer share the weights for any words."""


@dataclass(frozen=True)
class Standard:
    """How features are standardised: arrays (2, K, D) for moves and stops."""

    mean: Floats
    deviation: Floats

    @property
    def moments(self) -> int:
        """K."""
        return self.mean.shape[1]


@dataclass(frozen=True)
class Learned:
    """Weights (2, K * D) by the kind of words, and how well they repeat the expert."""

    standard: Standard
    weights: dict[Words, Floats]

    def score(self, decisions: Sequence[Decision]) -> tuple[float, float]:
        """Agreement and mean hinge loss on other decisions."""
        agreed, lost = 0.0, 0.0
        for words in get_args(Words):
            own = [one for one in decisions if one.words == words]
            states = states_of(own, self.standard)
            weights = self.weights.get(words, self.weights["any"])
            agreed += agreement(weights, states) * len(own)
            lost += mean_loss(weights, states) * len(own)
        count = max(len(decisions), 1)
        return agreed / count, lost / count

    def struct(self, provenance: Provenance) -> LinearWeights:
        """As it is kept in a file."""
        move, stop = (self._block(number) for number in (0, 1))
        return LinearWeights(
            provenance=provenance,
            moments=self.standard.moments,
            patience=_patience,
            confirmed=_confirmed,
            confirmed_late=_confirmed_late,
            late_s=_late_s,
            confirmed_still=_confirmed,
            stop_above=_stop_above,
            move=move,
            stop=stop,
        )

    def _block(self, number: int) -> Block:
        shape = self.standard.mean.shape[1:]
        return Block(
            mean=by_feature(self.standard.mean[number], names),
            deviation=by_feature(self.standard.deviation[number], names),
            weights={
                words: by_feature(weights[number].reshape(shape), names)
                for words, weights in self.weights.items()
            },
        )


def learn(
    decisions: Sequence[Decision],
    moments: int,
    seed: int,
    settings: FitSettings | None = None,
    progress: Callable[[Words], None] | None = None,
) -> Learned:
    """Weights for every kind of words that is in the decisions, and for any.

    Each kind starts from the weights for any words, of which there are more examples.
    """
    settings, standard = settings or FitSettings(), standard_of(decisions, moments)
    start = np.zeros((2, standard.mean[0].size))
    weights: dict[Words, Floats] = {}
    for number, words in enumerate(("any", *get_args(Words)[:-1])):
        own = [one for one in decisions if words in ("any", one.words)]
        if words != "any" and len(own) < _least_decisions:
            continue
        if progress:
            progress(words)
        rng = np.random.default_rng([seed, number])
        begin = weights.get("any", start)
        weights[words] = fit(states_of(own, standard), begin, settings, rng).weights
    return Learned(standard, weights)


def standard_of(decisions: Sequence[Decision], moments: int) -> Standard:
    """Mean over all candidates, and deviation; what is constant stays as it is, as a bias.

    Of moves the deviation within decisions counts: what is the same for all moves of a decision
    decides nothing, however much it differs from decision to decision.
    """
    features = [one.features[:, :moments].astype(np.float64) for one in decisions]
    moves, stopping = (
        [rows[stops(rows) == is_stop] for rows in features] for is_stop in (False, True)
    )
    within = np.concatenate([rows - rows.mean(axis=0) for rows in moves if len(rows)])
    every = [np.concatenate(rows) for rows in (moves, stopping)]
    blocks = [_moments_of(every[0], within), _moments_of(every[1], every[1])]
    return Standard(*(np.stack(part) for part in zip(*blocks, strict=True)))


def _moments_of(rows: Floats, spread: Floats) -> tuple[Floats, Floats]:
    if len(rows) == 0:
        return np.zeros(rows.shape[1:]), np.ones(rows.shape[1:])
    deviation = spread.std(axis=0)
    varies = deviation > _constant
    mean = np.where(varies, rows.mean(axis=0), 0.0)
    return mean, np.where(varies, np.maximum(deviation, _least_deviation), 1.0)


def states_of(decisions: Sequence[Decision], standard: Standard) -> list[State]:
    """What the fit reads of them."""
    return [_state(one, standard) for one in decisions]


def _state(decision: Decision, standard: Standard) -> State:
    is_stop = stops(decision.features)
    own = decision.features[:, : standard.moments]
    values = standardised(own, is_stop, standard.mean, standard.deviation)
    return State(
        values=values.reshape(len(values), -1).astype(np.float32),
        block=is_stop.astype(np.intp),
        label=decision.label,
        margin=decision.margin,
    )
