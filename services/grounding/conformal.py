"""How many readings must be kept so that the right one is among them often enough.

Split conformal prediction: on sentences that training did not see, the score is 1 - p(what was
meant); the threshold is its quantile at rank ceil((n + 1)(1 - error rate)). The set of readings
whose score is no larger then holds what was meant with probability 1 - error rate, averaged over
calibration sets. For one set of n sentences the coverage itself varies (`coverage_spread`): with
39 of them by about 0.05 either way, so the promise is coarse.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from services.grounding.weights import weights_path

T = TypeVar("T")

ERROR_RATE = 0.1
"""Share of sentences whose right reading may be missing from the set."""
IMPROBABLE = 0.1
"""A reading below this is never worth a question, however few sentences calibrated the rule."""
_MASS = 1.0 - ERROR_RATE
_report_key = "conformal_scores"


@dataclass(frozen=True)
class ConformalSet:
    """The rule that decides which readings are still possible."""

    threshold: float
    """Largest score 1 - p of a member."""
    examples: int
    """Sentences that the threshold was calibrated on."""

    def members(self, readings: Mapping[T, float]) -> tuple[T, ...]:
        """Readings that cannot be ruled out, best first; never empty where there are readings.

        Where none passes, the text is unlike those of the calibration and no promise holds; then
        the best ones stay, up to 1 - error rate of the mass.
        """
        ranked = sorted(readings, key=lambda one: -readings[one])
        least = max(1.0 - self.threshold, IMPROBABLE)
        kept = [one for one in ranked if readings[one] >= least]
        return tuple(kept or _heaviest(ranked, readings))

    @property
    def coverage_spread(self) -> float:
        """Standard deviation of the true coverage, which follows a Beta distribution."""
        rank = _rank(self.examples, ERROR_RATE)
        a, b = rank, self.examples + 1 - rank
        return math.sqrt(a * b / ((a + b) ** 2 * (a + b + 1))) if b > 0 else 0.0


def calibrated(scores: Sequence[float], error_rate: float = ERROR_RATE) -> ConformalSet:
    """The rule from scores 1 - p(what was meant) of sentences that training did not see.

    With fewer than 1 / error rate - 1 sentences nothing can be ruled out.
    """
    rank = _rank(len(scores), error_rate)
    threshold = sorted(scores)[rank - 1] if rank <= len(scores) else 1.0
    return ConformalSet(threshold, len(scores))


def load_conformal(robot: str) -> ConformalSet:
    """The rule from the cross-validation scores in the report beside a robot's weights.

    A report without scores rules out only what is improbable.
    """
    path = weights_path(robot).with_suffix(".report.json")
    return calibrated(_scores(path))


def _scores(path: Path) -> list[float]:
    report: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return [float(score) for score in report.get(_report_key, ())]


def _heaviest(ranked: list[T], readings: Mapping[T, float]) -> list[T]:
    kept: list[T] = []
    for one in ranked:
        if kept and (readings[one] < IMPROBABLE or sum(map(readings.__getitem__, kept)) >= _MASS):
            break
        kept.append(one)
    return kept


def _rank(count: int, error_rate: float) -> int:
    return math.ceil((count + 1) * (1.0 - error_rate) - 1e-9)
