"""Laws of training: merged rows, cross-validation by construction, calibration."""

import math

import numpy as np
import pytest

from robots.catalogue import get_robot
from services.grounding.corpus import CORPORA, read_corpus
from services.grounding.features import SymbolFeatures
from services.grounding.lexicon import Lexicon
from services.grounding.model import tempered
from services.grounding.symbols import SymbolTable
from services.grounding.training.fit import fit
from services.grounding.training.rows import build_problem, labelled_phrases
from services.grounding.training.scoring import Unseen, best_temperature, conformal_scores
from services.grounding.training.train import by_construction
from services.grounding.training.worlds import sample_trial

SYMBOLS = get_robot("husky").symbols
TABLE = SymbolTable(SYMBOLS)
FEATURES = SymbolFeatures(TABLE, Lexicon.load(SYMBOLS))
EXAMPLES = read_corpus(CORPORA / "husky.txt", TABLE)[:8]
PROBLEM = build_problem([labelled_phrases(one) for one in EXAMPLES], FEATURES)


def test_merged_rows_stand_for_every_symbol_of_every_phrase() -> None:
    phrases = [len(one.symbols) for one in EXAMPLES]
    assert PROBLEM.counts.sum(axis=1).tolist() == [n * len(TABLE.symbols) for n in phrases]
    true = sum(len(symbols) for one in EXAMPLES for symbols in one.symbols)
    assert PROBLEM.counts[:, PROBLEM.signs > 0].sum() == true


def test_fit_is_the_optimum() -> None:
    seen = np.ones(len(EXAMPLES), dtype=np.bool_)
    best = fit(PROBLEM, seen, 0.01, np.zeros(len(PROBLEM.columns)))
    counts = PROBLEM.counts.sum(axis=0)

    def loss(values: np.ndarray) -> float:
        margins = PROBLEM.signs * (PROBLEM.design @ values)
        penalty = 0.005 * float(PROBLEM.costs @ values**2)
        return float(counts @ np.logaddexp(0.0, -margins)) + penalty

    rng = np.random.default_rng(1)
    for scale in (0.03, 0.3):
        assert loss(best) < loss(best + scale * rng.normal(size=len(best)))


def test_same_start_does_not_matter() -> None:
    seen = np.ones(len(EXAMPLES), dtype=np.bool_)
    cold = fit(PROBLEM, seen, 0.1, np.zeros(len(PROBLEM.columns)))
    warm = fit(PROBLEM, seen, 0.1, fit(PROBLEM, seen, 1.0, np.zeros(len(PROBLEM.columns))))
    assert np.abs(cold - warm).max() < 0.05


def test_sentences_of_one_construction_share_a_fold() -> None:
    examples = read_corpus(CORPORA / "husky.txt", TABLE)
    numbers = dict(zip((one.text for one in examples), by_construction(examples), strict=True))
    same = ("there is a cone behind the car", "there is a tree near the building")
    assert numbers[same[0]] == numbers[same[1]]
    assert numbers["drive to the hydrant"] != numbers[same[0]]


@pytest.mark.parametrize("temperature", [0.5, 1.0, 3.0])
def test_temperature_keeps_order_and_mass(temperature: float) -> None:
    readings = {frozenset({0}): 0.6, frozenset({1}): 0.25, frozenset({2}): 0.1}
    found = tempered(readings, temperature)
    assert list(found.values()) == sorted(found.values(), reverse=True)
    lost = 0.05 ** (1 / temperature)
    total = sum(p ** (1 / temperature) for p in readings.values()) + lost
    assert math.fsum(found.values()) == pytest.approx(1.0 - lost / total)
    assert tempered({}, temperature) == {}


def test_wrong_and_sure_asks_for_a_higher_temperature() -> None:
    cone, tree = (frozenset({TABLE.parse(name)}) for name in ("cone", "tree"))
    right = Unseen(TABLE, {cone: 0.9, tree: 0.1}, cone)
    wrong = Unseen(TABLE, {cone: 0.9, tree: 0.1}, tree)
    assert best_temperature([right] * 9) < best_temperature([right] * 7 + [wrong] * 3)
    assert conformal_scores([right, wrong], 1.0) == [0.0, 0.0]  # Both say that nothing is to do.


def test_sampled_maps_hold_what_is_meant() -> None:
    rng = np.random.default_rng(2)
    for _ in range(50):
        trial = sample_trial(("back", "near", "inside", "down", "towards", "around"), rng)
        if trial.answer is not None:
            assert 0 <= trial.answer < len(trial.world.classes)
