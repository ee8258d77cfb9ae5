"""From detector scores to probabilities.

A score is what the loss made of it; a particle filter needs "of the boxes that look like this,
how many are what they seem". Two questions, three numbers fitted on held-out pictures: is there an
object at all (logistic in the score's logit; Platt, 1999), and which one (softmax of the class
logits at a temperature; Guo et al., 2017).
"""

import numpy as np
from msgspec import Struct

from schemas.arrays import Flags, Floats, Ints

_least = 1e-6


class Calibration(Struct, frozen=True, kw_only=True):
    """What was fitted."""

    slope: float = 1.0
    """Of the object logit in the score's logit."""
    offset: float = 0.0
    """Of the object logit."""
    temperature: float = 1.0
    """Of the class logits; above 1 the classes come out less certain."""

    def object_probabilities(self, scores: Floats) -> Floats:
        """Probability (N,) that a box with such a score is on an object of any known class."""
        return _sigmoid(self.slope * _logit(scores) + self.offset)

    def class_probabilities(self, class_scores: Floats) -> Floats:
        """Distribution over classes (N, C) given that the box is on an object; rows sum to 1."""
        return _softmax(_logit(class_scores) / self.temperature)

    def distribution(self, scores: Floats, class_scores: Floats) -> Floats:
        """Probability (N, C) of each class; what a row lacks to 1 is "nothing of these"."""
        found = self.object_probabilities(scores)
        return found[:, None] * self.class_probabilities(class_scores)


class ReliabilityBin(Struct, frozen=True, kw_only=True):
    """Boxes that were given about the same probability."""

    probability: float
    """Mean of what they were given."""
    frequency: float
    """Share that was on an object of the class named."""
    count: int


def fit(scores: Floats, class_scores: Floats, on_object: Flags, true_classes: Ints) -> Calibration:
    """Fit to boxes with scores (N,), class scores (N, C), and what they really were.

    `true_classes` (N,) counts only where `on_object`.
    """
    slope, offset = _logistic_fit(_logit(scores), on_object)
    temperature = _temperature_fit(class_scores[on_object], true_classes[on_object])
    return Calibration(slope=slope, offset=offset, temperature=temperature)


def reliability(probabilities: Floats, correct: Flags, bins: int = 10) -> list[ReliabilityBin]:
    """Compare probabilities (N,) with outcomes (N,) in bins of equal width; empty ones left out."""
    index = np.minimum((probabilities * bins).astype(int), bins - 1)
    return [
        ReliabilityBin(
            probability=float(probabilities[index == i].mean()),
            frequency=float(correct[index == i].mean()),
            count=int((index == i).sum()),
        )
        for i in range(bins)
        if (index == i).any()
    ]


def calibration_error(table: list[ReliabilityBin]) -> float:
    """Mean gap between probability and frequency, weighted by count."""
    total = sum(row.count for row in table)
    return sum(row.count * abs(row.probability - row.frequency) for row in table) / max(total, 1)


def _logistic_fit(x: Floats, outcomes: Flags, steps: int = 30) -> tuple[float, float]:
    """Newton's method with Platt's smoothed outcomes, so that separable data stay finite."""
    positives, negatives = int(outcomes.sum()), int((~outcomes).sum())
    wanted = np.where(outcomes, (positives + 1) / (positives + 2), 1 / (negatives + 2))
    design, weights = np.column_stack([x, np.ones_like(x)]), np.array([1.0, 0.0])
    for _ in range(steps):
        predicted = _sigmoid(design @ weights)
        gradient = design.T @ (predicted - wanted)
        curvature = (design * (predicted * (1 - predicted))[:, None]).T @ design
        weights = weights - np.linalg.solve(curvature + 1e-3 * np.eye(2), gradient)
    return float(weights[0]), float(weights[1])


def _temperature_fit(class_scores: Floats, true_classes: Ints) -> float:
    if not len(true_classes):
        return 1.0
    candidates = np.exp(np.linspace(np.log(0.25), np.log(4.0), 81))
    rows = np.arange(len(true_classes))

    def surprise(temperature: float) -> float:
        distribution = Calibration(temperature=temperature).class_probabilities(class_scores)
        return -float(np.log(distribution[rows, true_classes] + _least).mean())

    return float(min(candidates, key=surprise))


def _logit(probabilities: Floats) -> Floats:
    clipped = np.clip(probabilities, _least, 1 - _least)
    return np.log(clipped / (1 - clipped))


def _sigmoid(x: Floats) -> Floats:
    return 1 / (1 + np.exp(-x))


def _softmax(logits: Floats) -> Floats:
    powers = np.exp(logits - logits.max(axis=1, keepdims=True))
    return powers / powers.sum(axis=1, keepdims=True)
