"""Trains a robot's grounding from its corpus and says how good it is on what it has not seen."""

import json
import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robots.symbols import SymbolSpace, get_symbols
from services.grounding.behavior import PAIR_FEATURES
from services.grounding.corpus import CORPORA, Example, read_corpus, read_held_out
from services.grounding.dcg import Weights
from services.grounding.features import SymbolFeatures
from services.grounding.hdcg import RuleFeatures
from services.grounding.lexicon import Lexicon
from services.grounding.model import GroundingModel
from services.grounding.parser import Parse
from services.grounding.spatial import DENSITY
from services.grounding.symbols import UNKNOWN, SymbolTable
from services.grounding.training.evaluation import evaluate
from services.grounding.training.fit import fit
from services.grounding.training.pairs import evaluate_pairs, fit_pairs, sample_choices
from services.grounding.training.rows import (
    Problem,
    build_problem,
    labelled_phrases,
    labelled_rules,
)
from services.grounding.training.scoring import (
    Unseen,
    best_temperature,
    conformal_scores,
    mean_log_probability,
    summary,
)
from services.grounding.weights import ModelWeights, save_weights, weights_path

PENALTIES = (0.003, 0.001, 0.0003, 0.0001)
"""Descending, as the solution of one starts the search for the next."""
FOLDS = 4
"""Of the cross-validation that chooses the penalty."""
CALIBRATION_FOLDS = 10
"""Of those that calibrate: the more, the closer their models are to the one that is kept."""
SAMPLED_MAPS = 4000
SEED = 0

_WORD = re.compile(r"\((\S+) [^()]+\)")

Progress = Callable[[str, float], None]
"""Called with what is being done and the share that is done, in [0, 1]."""


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
    lexicon = Lexicon.load(symbols)
    features = SymbolFeatures(SymbolTable(symbols), lexicon)
    rules = RuleFeatures(features.table, lexicon)
    examples = read_corpus(CORPORA / f"{robot}.txt", features.table)
    progress("features of every phrase", 0.0)
    problem = build_problem([labelled_phrases(one) for one in examples], features)
    validation = Validation(examples, problem, GroundingModel(lexicon, untempered(problem)))
    progress("choosing the penalty", 0.1)
    numbers = np.arange(len(examples))
    tried = validation.read(PENALTIES, numbers % FOLDS)
    penalty = max(PENALTIES, key=lambda one: mean_log_probability(tried[one]))
    progress("calibrating", 0.4)
    familiar = validation.read((penalty,), numbers % CALIBRATION_FOLDS)[penalty]
    novel = validation.read((penalty,), by_construction(examples) % CALIBRATION_FOLDS)[penalty]
    # People say things in the ways of the corpus and in others; this takes as many of each.
    unseen = [*familiar, *novel]
    temperature = best_temperature(unseen)
    progress("final weights", 0.8)
    pairs, pair_report = train_pairs(symbols)
    weights = ModelWeights(
        factors=_fit_all(problem, penalty),
        rules=_fit_rules(examples, rules, penalty) if symbols.hierarchical else None,
        pairs=pairs,
        temperature=temperature,
    )
    report = {
        "robot": robot,
        "examples": len(examples),
        "symbols": len(features.table.symbols),
        "penalty": penalty,
        "temperature": round(temperature, 3),
        "cross_validation": summary(familiar, temperature),
        "unseen_constructions": summary(novel, temperature),
        "held_out": _held_out(robot, GroundingModel(lexicon, weights)),
        "pairs": pair_report,
        "conformal_scores": conformal_scores(unseen, temperature),
        "train_s": round(time.perf_counter() - started, 1),
    }
    target = weights_path(robot) if folder is None else folder / f"{robot}.json"
    save_weights(target, weights, features, rules)
    target.with_suffix(".report.json").write_text(json.dumps(report, indent=2) + "\n", "utf-8")
    progress("done", 1.0)
    return report


@dataclass(frozen=True)
class Validation:
    """Cross-validation of the whole model, parser included."""

    examples: Sequence[Example]
    problem: Problem
    reader: GroundingModel
    """Of any weights."""

    @cached_property
    def _parses(self) -> list[tuple[Parse, ...]]:
        return [self.reader.parses(one.text) for one in self.examples]

    def read(
        self, penalties: Sequence[float], folds: NDArray[np.int64]
    ) -> dict[float, list[Unseen]]:
        """What is made of every example under each penalty by weights that have not seen its fold.

        Args:
            penalties: descending.
            folds: fold of every example (examples,).
        """
        found: dict[float, list[Unseen]] = {penalty: [] for penalty in penalties}
        for fold in np.unique(folds):
            left_out = folds == fold
            values = np.zeros(len(self.problem.columns))
            for penalty in penalties:
                values = fit(self.problem, ~left_out, penalty, values)
                model = self.reader.retrained(untempered(self.problem, values))
                found[penalty] += [
                    self._unseen(model, at) for at in np.flatnonzero(left_out).tolist()
                ]
        return found

    def _unseen(self, model: GroundingModel, at: int) -> Unseen:
        readings = model.readings_of(self._parses[at])
        return Unseen(model.table, readings, self.examples[at].symbols[0])


def by_construction(examples: Sequence[Example]) -> NDArray[np.int64]:
    """A number for each way to build a sentence: its tree without the words (examples,)."""
    shapes: dict[str, int] = {}
    trees = (_WORD.sub(r"(\1)", one.tree.bracket()) for one in examples)
    return np.array([shapes.setdefault(tree, len(shapes)) for tree in trees])


def untempered(problem: Problem, values: NDArray[np.float64] | None = None) -> ModelWeights:
    """A model of the factors alone, as they are while it is being trained; zeros by default."""
    learned = np.zeros(len(problem.columns)) if values is None else values
    return ModelWeights(problem.weights(learned), None, np.zeros(len(PAIR_FEATURES)), 1.0)


def _fit_all(problem: Problem, penalty: float) -> Weights:
    everything = np.ones(len(problem.counts), dtype=np.bool_)
    return problem.weights(fit(problem, everything, penalty, np.zeros(len(problem.columns))))


def _fit_rules(examples: Sequence[Example], rules: RuleFeatures, penalty: float) -> Weights:
    problem = build_problem([labelled_rules(one, rules) for one in examples], rules)
    return _fit_all(problem, penalty)


def _held_out(robot: str, model: GroundingModel) -> dict[str, Any] | None:
    """Scores on sentences kept apart; None for a robot that has none."""
    path = CORPORA / f"{robot}.heldout.txt"
    if not path.exists():
        return None
    sentences = read_held_out(path, model.table)
    found = [Unseen(model.table, model.readings(one.text), one.symbols) for one in sentences]
    return summary(found, 1.0) | evaluate(model, sentences)


def train_pairs(symbols: SymbolSpace) -> tuple[NDArray[np.float64], dict[str, float]]:
    """Weights of the pair features from sampled maps, and how good they are on others."""
    relations = tuple(name for name in symbols.relations if name in DENSITY and name != UNKNOWN)
    rng = np.random.default_rng(SEED)
    weights = fit_pairs(sample_choices(SAMPLED_MAPS, relations, rng))
    report = evaluate_pairs(sample_choices(SAMPLED_MAPS // 4, relations, rng), weights)
    return weights, {name: round(value, 3) for name, value in report.items()}
