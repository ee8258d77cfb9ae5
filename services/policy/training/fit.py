"""Fits the weights of one kind of words: multi-class hinge loss, loss-augmented sub-gradient.

Eqs. svm-loss to update-rule, with three changes that were measured to help. The margin is
cost-sensitive: l(a) grows from 0 with the regret of the action, so that near-duplicates of the
expert's action do not fight it. Iterates of the second half are averaged. Moves and stops have
weights of their own.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from schemas.arrays import Floats

Values = NDArray[np.floating]


@dataclass(frozen=True)
class State:
    """One decision of C candidates with P standardised feature moments."""

    values: Values
    """(C, P)"""
    block: NDArray[np.intp]
    """(C,) 0 for moves, 1 for stops."""
    label: int
    """The expert's action."""
    margin: Values
    """(C,) l_xa of Eq. loss-augmentation, 0 for the label."""


@dataclass(frozen=True)
class FitSettings:
    """Of the sub-gradient method."""

    penalty: float = 3e-4
    """lambda of Eq. optimization-loss."""
    step: float = 0.05
    decay: float = 0.7
    """gamma: alpha = step / (1 + t / constant)^gamma."""
    constant: float = 2000.0
    epochs: int = 100
    """So many that the loss has settled, which takes seconds beside the minutes of acting."""


@dataclass(frozen=True)
class Fitted:
    """What was learned, and how it went."""

    weights: Floats
    """(2, P) of moves and stops."""
    losses: tuple[float, ...]
    """Mean hinge loss in each epoch, as the weights went by."""
    agreements: tuple[float, ...]
    """Share of decisions in each epoch that were the expert's."""


def costs(weights: Values, state: State) -> Values:
    """W^T F (C,), weights (2, P)."""
    return np.einsum("cp,cp->c", state.values, weights[state.block])


def loss(weights: Values, state: State, penalty: float) -> float:
    """Eq. optimization-loss."""
    cost = costs(weights, state)
    hinge = cost[state.label] - np.min(cost - state.margin)
    return float(0.5 * penalty * np.sum(weights**2) + hinge)


def subgradient(weights: Values, state: State, penalty: float) -> Values:
    """Lambda W + F_* - F_a', a' the best loss-augmented action; shape (2, P)."""
    augmented = int(np.argmin(costs(weights, state) - state.margin))
    gradient = penalty * weights
    gradient[state.block[state.label]] += state.values[state.label]
    gradient[state.block[augmented]] -= state.values[augmented]
    return gradient


def agreement(weights: Values, states: Sequence[State]) -> float:
    """Share of decisions that are the expert's."""
    same = [int(np.argmin(costs(weights, state))) == state.label for state in states]
    return float(np.mean(same)) if same else 0.0


def mean_loss(weights: Values, states: Sequence[State]) -> float:
    """Mean hinge loss without the penalty."""
    return float(np.mean([loss(weights, state, 0.0) for state in states])) if states else 0.0


def fit(states: Sequence[State], start: Floats, settings: FitSettings, rng: Generator) -> Fitted:
    """Learn from decisions.

    Args:
        states: the decisions; their order does not matter but for the order of the steps.
        start: (2, P) weights to begin with.
        settings: of the method.
        rng: shuffles the decisions in each epoch.
    """
    weights, total, averaged, time = start.copy(), np.zeros_like(start), 0, 0
    losses: list[float] = []
    agreements: list[float] = []
    for epoch in range(settings.epochs):
        lost, agreed = 0.0, 0
        for number in rng.permutation(len(states)).tolist():
            state = states[number]
            cost = costs(weights, state)
            lost += float(cost[state.label] - np.min(cost - state.margin))
            agreed += int(np.argmin(cost)) == state.label
            alpha = settings.step / (1 + time / settings.constant) ** settings.decay
            weights = weights - alpha * subgradient(weights, state, settings.penalty)
            time += 1
            if 2 * epoch >= settings.epochs:
                total, averaged = total + weights, averaged + 1
        losses.append(lost / max(len(states), 1))
        agreements.append(agreed / max(len(states), 1))
    mean = total / averaged if averaged else weights
    return Fitted(mean, tuple(losses), tuple(agreements))
