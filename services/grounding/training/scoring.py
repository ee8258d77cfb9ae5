"""How good readings of sentences are that training did not see."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from services.grounding.features import SymbolSet
from services.grounding.model import tempered
from services.grounding.symbols import SymbolTable
from services.grounding.training.calibration import expected_calibration_error
from services.grounding.understanding import Annotation, Intent, annotations_of, intents_of

LEAST_PROBABILITY = 1e-6
"""Stands for readings that the K-best search left out."""
TEMPERATURES = np.geomspace(0.5, 4.0, 43)


@dataclass(frozen=True)
class Unseen:
    """One sentence that training did not see."""

    table: SymbolTable
    readings: dict[SymbolSet, float]
    right: SymbolSet
    """The symbols of the whole sentence that are true."""

    @property
    def wanted(self) -> Annotation:
        """What the sentence says about the world."""
        return annotations_of({self.right: 1.0}, self.table)[0]

    def best(self, temperature: float) -> tuple[float, bool]:
        """Stated probability of the best annotation, and whether it is exactly right."""
        (best, *_) = annotations_of(tempered(self.readings, temperature), self.table)
        wanted = self.wanted
        return best.probability, (best.objects, best.relations) == (
            wanted.objects,
            wanted.relations,
        )

    @property
    def behavior(self) -> bool:
        """Whether the best intent, or that there is none, is exactly right."""
        return _best_intent(self.readings, self.table) == _best_intent(
            {self.right: 1.0}, self.table
        )

    def intent_probability(self, temperature: float) -> float:
        """Stated probability of the right intent, or that there is none."""
        wanted = _best_intent({self.right: 1.0}, self.table)
        intents, nothing = intents_of(tempered(self.readings, temperature), self.table)
        found = [i.probability for i in intents if replace(i, probability=1.0) == wanted]
        return nothing if wanted is None else sum(found)


def _best_intent(readings: dict[SymbolSet, float], table: SymbolTable) -> Intent | None:
    """The most probable intent without its probability, None if doing nothing is as probable."""
    intents, nothing = intents_of(readings, table)
    acts = intents and intents[0].probability > nothing
    return replace(intents[0], probability=1.0) if acts else None


def mean_log_probability(unseen: Sequence[Unseen]) -> float:
    """Of the right symbols of the whole sentence."""
    right = [max(one.readings.get(one.right, 0.0), LEAST_PROBABILITY) for one in unseen]
    return sum(map(math.log, right)) / len(right)


def best_temperature(unseen: Sequence[Unseen]) -> float:
    """The temperature under which stated probabilities best predict what is right."""

    def loss(temperature: float) -> float:
        stated = [one.best(temperature) for one in unseen]
        return -sum(math.log(max(p if right else 1.0 - p, 1e-6)) for p, right in stated)

    return min(TEMPERATURES.tolist(), key=loss)


def conformal_scores(unseen: Sequence[Unseen], temperature: float) -> list[float]:
    """One less the stated probability of what is to be done, ascending."""
    return sorted(round(1.0 - one.intent_probability(temperature), 4) for one in unseen)


def summary(unseen: Sequence[Unseen], temperature: float) -> dict[str, float]:
    """Accuracy and calibration over sentences that training did not see."""
    stated = [one.best(temperature) for one in unseen]
    confidence = np.array([p for p, _ in stated])
    correct = np.array([right for _, right in stated], dtype=np.bool_)
    return {
        "sentences": len(unseen),
        "annotation_accuracy": round(float(correct.mean()), 3),
        "behavior_accuracy": round(sum(one.behavior for one in unseen) / len(unseen), 3),
        "expected_calibration_error": round(expected_calibration_error(confidence, correct), 3),
        "mean_log_probability": round(mean_log_probability(unseen), 3),
    }
