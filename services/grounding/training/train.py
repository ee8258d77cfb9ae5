"""Trains a robot's grounding from its corpus and says how good it is on what it has not seen."""

import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robots.symbols import SymbolSpace, get_symbols
from services.grounding.behavior import PAIR_FEATURES
from services.grounding.corpus import CORPORA, Example, HeldOut, read_corpus, read_held_out
from services.grounding.dcg import Weights
from services.grounding.features import SymbolSet
from services.grounding.lexicon import Lexicon
from services.grounding.model import GroundingModel
from services.grounding.spatial import DENSITY
from services.grounding.symbols import SymbolTable
from services.grounding.training.calibration import expected_calibration_error
from services.grounding.training.fit import fit
from services.grounding.training.pairs import evaluate_pairs, fit_pairs, sample_choices
from services.grounding.training.rows import build_problem
from services.grounding.understanding import Intent, annotations_of, intents_of
from services.grounding.weights import DECIMALS, save_weights, weights_path

PENALTIES = (0.001, 0.003, 0.01, 0.03)
FOLDS = 5
SAMPLED_MAPS = 4000
SEED = 0

Progress = Callable[[str, float], None]
"""Called with what is being done and the share that is done, in [0, 1]."""


@dataclass(frozen=True)
class Score:
    """One held-out sentence."""

    annotation: bool
    """Whether the best annotation is exactly right."""
    behavior: bool
    """Whether the best intent (or that there is none) is exactly right."""
    confidence: float
    """Stated probability of the best annotation."""
    log_probability: float
    """Of the right symbols of the whole sentence."""


def train_grounding(robot: str, progress: Progress, folder: Path | None = None) -> dict[str, Any]:
    """Fits weights by L-BFGS, with the penalty chosen by cross-validation, and writes them.

    Args:
        robot: whose symbols and corpus are used.
        progress: told what is being done.
        folder: where weights and report are written; the package's own by default.

    Returns:
        The report, also written beside the weights as `<robot>.report.json`.

    Raises:
        GroundingError: the corpus has an error (file, line, what is allowed).
    """
    started = time.perf_counter()
    symbols = get_symbols(robot)
    table, lexicon = SymbolTable(symbols), Lexicon.load(symbols)
    examples = read_corpus(CORPORA / f"{robot}.txt", table)
    held_out = read_held_out(CORPORA / f"{robot}.heldout.txt", table)
    scores = _cross_validate(examples, table, lexicon, progress)
    best = max(PENALTIES, key=lambda penalty: _mean_log_probability(scores[penalty]))
    progress("final weights", 0.7)
    weights = fit(build_problem(examples, table, lexicon), best)
    progress("pairs of objects in sampled maps", 0.75)
    pair_weights, pair_report = _train_pairs(symbols)
    model = GroundingModel(lexicon, weights, pair_weights)
    report = {
        "robot": robot,
        "examples": len(examples),
        "symbols": len(table.symbols),
        "penalty": best,
        "cross_validation": _summary(scores[best]),
        "held_out": _summary([_score(model, one) for one in held_out]),
        "pairs": pair_report,
        "train_s": round(time.perf_counter() - started, 1),
    }
    target = weights_path(robot) if folder is None else folder / f"{robot}.json"
    _write(target, weights, table, pair_weights, report)
    progress("done", 1.0)
    return report


def _cross_validate(
    examples: Sequence[Example], table: SymbolTable, lexicon: Lexicon, progress: Progress
) -> dict[float, list[Score]]:
    """Scores of every example under each penalty, from weights that have not seen it."""
    scores: dict[float, list[Score]] = {penalty: [] for penalty in PENALTIES}
    for fold in range(FOLDS):
        progress(f"cross-validation, fold {fold + 1} of {FOLDS}", 0.7 * fold / FOLDS)
        seen = [one for at, one in enumerate(examples) if at % FOLDS != fold]
        unseen = [HeldOut(one.text, one.symbols[0]) for one in examples[fold::FOLDS]]
        problem = build_problem(seen, table, lexicon)
        for penalty in PENALTIES:
            weights = fit(problem, penalty)
            model = GroundingModel(lexicon, weights, np.zeros(len(PAIR_FEATURES)))
            scores[penalty] += [_score(model, one) for one in unseen]
    return scores


def _score(model: GroundingModel, example: HeldOut) -> Score:
    """Compares what the whole model (parser included) says with the right symbols."""
    right: dict[SymbolSet, float] = {example.symbols: 1.0}
    wanted = annotations_of(right, model.table)[0]
    understanding = model.understand(example.text)
    readings = model.readings(example.text)
    found = understanding.annotations[0]
    return Score(
        annotation=(found.objects, found.relations) == (wanted.objects, wanted.relations),
        behavior=_best_intent(readings, model.table) == _best_intent(right, model.table),
        confidence=found.probability,
        log_probability=math.log(max(readings.get(example.symbols, 0.0), 1e-6)),
    )


def _best_intent(readings: dict[SymbolSet, float], table: SymbolTable) -> Intent | None:
    """The most probable intent without its probability, None if doing nothing is as probable."""
    intents, nothing = intents_of(readings, table)
    acts = intents and intents[0].probability > nothing
    return replace(intents[0], probability=1.0) if acts else None


def _mean_log_probability(scores: Sequence[Score]) -> float:
    return sum(score.log_probability for score in scores) / len(scores)


def _summary(scores: Sequence[Score]) -> dict[str, float]:
    confidence = np.array([score.confidence for score in scores])
    correct = np.array([score.annotation for score in scores], dtype=np.bool_)
    return {
        "sentences": len(scores),
        "annotation_accuracy": round(float(correct.mean()), 3),
        "behavior_accuracy": round(sum(score.behavior for score in scores) / len(scores), 3),
        "expected_calibration_error": round(expected_calibration_error(confidence, correct), 3),
        "mean_log_probability": round(_mean_log_probability(scores), 3),
    }


def _train_pairs(symbols: SymbolSpace) -> tuple[NDArray[np.float64], dict[str, float]]:
    relations = tuple(name for name in symbols.relations if name in DENSITY)
    rng = np.random.default_rng(SEED)
    weights = fit_pairs(sample_choices(SAMPLED_MAPS, relations, rng))
    report = evaluate_pairs(sample_choices(SAMPLED_MAPS // 4, relations, rng), weights)
    return weights, {name: round(value, 3) for name, value in report.items()}


def _write(
    target: Path,
    weights: Weights,
    table: SymbolTable,
    pair_weights: NDArray[np.float64],
    report: dict[str, Any],
) -> None:
    named = zip(PAIR_FEATURES, pair_weights.round(DECIMALS).tolist(), strict=True)
    save_weights(target, weights, table, {"pairs": dict(named)})
    text = json.dumps(report, indent=2) + "\n"
    target.with_suffix(".report.json").write_text(text, encoding="utf-8")
