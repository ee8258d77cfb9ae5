"""Where a trained model is right, how sure it is of it, and what it takes for what."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from services.grounding.corpus import HeldOut
from services.grounding.model import GroundingModel
from services.grounding.training.calibration import BINS
from services.grounding.understanding import Annotation, Intent, annotations_of, intents_of

ROLES = ("action", "object", "mode", "relation", "landmark", "comparative")
NOTHING = "nothing"
"""Stands for a role where nothing is to be done."""


@dataclass(frozen=True)
class Answer:
    """The best reading of a sentence, or the right one."""

    annotation: Annotation
    intent: Intent | None
    """None where nothing is to be done."""

    @property
    def statement(self) -> object:
        """What is said of the world, without its probability."""
        return self.annotation.objects, self.annotation.relations

    def role(self, name: str) -> str:
        """One part of what is to be done."""
        return str(getattr(self.intent, name)) if self.intent else NOTHING


def evaluate(model: GroundingModel, sentences: Sequence[HeldOut]) -> dict[str, Any]:
    """Reliability of stated probabilities, and confusions of every role, on unseen sentences."""
    found = [_found(model, one.text) for one in sentences]
    right = [_right(model, one) for one in sentences]
    return {"reliability": _reliability(found, right), "confusion": _confusion(found, right)}


def _found(model: GroundingModel, text: str) -> Answer:
    understanding = model.understand(text)
    annotation = next(iter(understanding.annotations), Annotation(0.0, (), ()))
    return Answer(annotation, _acting(understanding.intents, understanding.statement_mass))


def _right(model: GroundingModel, sentence: HeldOut) -> Answer:
    gold = {sentence.symbols: 1.0}
    return Answer(annotations_of(gold, model.table)[0], _acting(*intents_of(gold, model.table)))


def _acting(intents: Sequence[Intent], nothing: float) -> Intent | None:
    return intents[0] if intents and intents[0].probability > nothing else None


def _reliability(found: Sequence[Answer], right: Sequence[Answer]) -> list[dict[str, float]]:
    """Bins of stated probability that have sentences: their mean and how often they are right."""
    confidence = np.array([one.annotation.probability for one in found])
    pairs = zip(found, right, strict=True)
    correct = np.array([a.statement == b.statement for a, b in pairs], dtype=np.float64)
    bins = np.minimum((confidence * BINS).astype(np.int64), BINS - 1)
    return [
        {
            "from": number / BINS,
            "sentences": int((bins == number).sum()),
            "stated": round(float(confidence[bins == number].mean()), 3),
            "right": round(float(correct[bins == number].mean()), 3),
        }
        for number in np.unique(bins).tolist()
    ]


def _confusion(found: Sequence[Answer], right: Sequence[Answer]) -> list[dict[str, Any]]:
    """Every "right taken for found", the commonest first."""
    counts = Counter(
        (role, wanted.role(role), got.role(role))
        for got, wanted in zip(found, right, strict=True)
        for role in ROLES
        if got.role(role) != wanted.role(role)
    )
    return [
        {"role": role, "right": wanted, "taken_for": got, "times": times}
        for (role, wanted, got), times in counts.most_common()
    ]
