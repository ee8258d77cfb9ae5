"""Fits the pair model of behaviour inference to sampled maps (a conditional logit)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.optimize import minimize

from services.grounding.behavior import (
    PAIR_FEATURES,
    Objects,
    candidates,
    features,
    pair_probabilities,
    prior,
)
from services.grounding.symbols import ROBOT
from services.grounding.training.calibration import expected_calibration_error
from services.grounding.training.worlds import LANDMARK, NAMES, Trial, sample_trial

PENALTY = 1.0
MAX_OBJECTS = 16
"""More objects than any sampled map has."""


@dataclass(frozen=True)
class Choices:
    """Candidate pairs of all trials joined."""

    design: NDArray[np.float64]
    """Pairs x pair features."""
    prior: NDArray[np.float64]
    """Log prior of each pair (rows,)."""
    trial: NDArray[np.int64]
    """Trial of each pair."""
    answer: NDArray[np.int64]
    """Number of the object that each pair is about, unique over all trials."""
    meant: NDArray[np.bool_]
    """Whether the pair is about what is meant; several pairs where any landmark will do."""
    trials: int


def sample_choices(count: int, relations: tuple[str, ...], rng: Generator) -> Choices:
    """Samples trials and joins their candidate pairs."""
    return _choices([sample_trial(relations, rng) for _ in range(count)])


def _choices(trials: Sequence[Trial]) -> Choices:
    designs: list[NDArray[np.bool_]] = []
    priors: list[NDArray[np.float64]] = []
    answers: list[NDArray[np.int64]] = []
    meant: list[NDArray[np.bool_]] = []
    for trial in trials:
        objects = Objects.join((trial.world,))
        pairs = candidates(trial.intent, objects, NAMES)
        designs.append(features(trial.intent, pairs, objects))
        priors.append(prior(trial.intent, pairs, 1))
        meant.append(_meant(trial, pairs.figure, pairs.landmark))
        sought = pairs.landmark if trial.intent.object == ROBOT else pairs.figure
        answers.append(sought + MAX_OBJECTS * len(answers))
    numbers = np.repeat(np.arange(len(trials)), [len(design) for design in designs])
    design = np.concatenate(designs).astype(np.float64)
    return Choices(
        design=design,
        prior=np.concatenate(priors),
        trial=numbers,
        answer=np.concatenate(answers),
        meant=np.concatenate(meant),
        trials=len(trials),
    )


def _meant(
    trial: Trial, figure: NDArray[np.int64], landmark: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether each pair is about what is meant, with any landmark where several would do."""
    answer = -2 if trial.answer is None else trial.answer
    if trial.intent.object == ROBOT:
        return landmark == answer
    if trial.intent.comparative or trial.intent.landmark != LANDMARK:
        return figure == answer
    placed_at = np.flatnonzero(trial.world.classes == NAMES.index(LANDMARK))[0]
    return (figure == answer) & (landmark == placed_at)


def fit_pairs(choices: Choices) -> NDArray[np.float64]:
    """Weights of `PAIR_FEATURES` that maximise the probability of what is meant."""
    absent = np.bincount(choices.trial, weights=choices.meant, minlength=choices.trials) == 0

    def objective(values: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        logits = choices.design @ values + choices.prior
        pairs, none = pair_probabilities(logits, choices.trial, choices.trials)
        right = np.bincount(choices.trial, weights=pairs * choices.meant, minlength=choices.trials)
        mass = np.where(absent, none, right)
        posterior = np.where(choices.meant, pairs / mass[choices.trial], 0.0)
        gradient = choices.design.T @ (pairs - posterior)
        loss = -float(np.log(mass).sum()) + 0.5 * PENALTY * float(values @ values)
        return loss, gradient + PENALTY * values

    found = minimize(objective, np.zeros(len(PAIR_FEATURES)), jac=True, method="L-BFGS-B")
    return np.asarray(found.x, dtype=np.float64)


def evaluate_pairs(choices: Choices, weights: NDArray[np.float64]) -> dict[str, float]:
    """Accuracy and calibration of the best answer (a figure or "none") on sampled maps."""
    logits = choices.design @ weights + choices.prior
    pairs, none = pair_probabilities(logits, choices.trial, choices.trials)
    numbers, at = np.unique(choices.answer, return_inverse=True)
    mass = np.bincount(at, weights=pairs)
    meant = np.bincount(at, weights=choices.meant) > 0
    trial = numbers // MAX_OBJECTS
    best, absent = np.zeros(choices.trials), np.ones(choices.trials, dtype=np.bool_)
    np.maximum.at(best, trial, mass)
    absent[trial[meant]] = False
    # Objects that nothing tells apart share the credit, whichever of them happens to come first.
    tied = np.bincount(trial, weights=mass == best[trial], minlength=choices.trials)
    hits = np.bincount(trial, weights=meant & (mass == best[trial]), minlength=choices.trials)
    correct = np.where(none >= best, absent, hits / np.maximum(tied, 1.0))
    confidence = np.maximum(best, none)
    return {
        "accuracy": float(correct.mean()),
        "expected_calibration_error": expected_calibration_error(confidence, correct),
    }
