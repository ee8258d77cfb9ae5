"""Two passes give the answer of one, from far fewer symbols."""

import itertools
import math

import pytest

from services.grounding.hdcg import RULE_SETS, HierarchicalGraph, RuleFeatures
from services.grounding.model import GroundingModel
from services.grounding.training.agreement import NotHierarchicalError, measure_agreement

MODEL = GroundingModel.load("wheelchair")
CLASSES = ("kitchen", "conference room", "elevator", "cone", "building")
PLACES = ("down", "past", "near", "behind", "to the left of")
TEXTS = [
    *(f"go to the {a} {r} the {b}" for a, b in itertools.pairwise(CLASSES) for r in PLACES),
    *(f"there is a {a} {r} the {b}" for a, b in itertools.pairwise(CLASSES) for r in PLACES),
    *(f"drive {r} the {a}" for a in CLASSES for r in PLACES),
    "turn left",
    "take me to the nearest elevator",
    "go quickly to the lab that is through the lounge near the office",
    "go to the moon",
    "sing a song",
]


def graph() -> HierarchicalGraph:
    assert MODEL.weights.rules
    return HierarchicalGraph(MODEL.features, MODEL.weights.factors, MODEL.weights.rules)


def test_two_passes_agree_with_one_and_score_far_fewer_symbols() -> None:
    found = measure_agreement(MODEL, TEXTS)
    assert found.sentences == len(TEXTS)
    assert found.same_best >= 0.99
    assert found.total_variation < 0.05
    assert found.pruning_factor >= 10.0


def test_agreement_needs_rule_weights() -> None:
    with pytest.raises(NotHierarchicalError, match="wheelchair"):
        measure_agreement(GroundingModel.load("husky"), TEXTS[:1])


@pytest.mark.parametrize("text", TEXTS[::13])
def test_masses_of_rule_sets_and_readings(text: str) -> None:
    tree = MODEL.parses(text)[0].tree
    found = graph()
    rule_sets = found.rule_sets(tree)
    assert 1 <= len(rule_sets) <= RULE_SETS
    assert math.fsum(rule_sets.values()) == pytest.approx(1.0)
    probabilities = list(found.infer(tree).values())
    assert probabilities == sorted(probabilities, reverse=True)
    assert math.fsum(probabilities) <= 1.0 + 1e-9


def test_rules_of_a_symbol_are_its_constituents() -> None:
    rules = RuleFeatures(MODEL.table, MODEL.lexicon)
    projected = rules.project([MODEL.table.parse("down(kitchen, hallway)")])
    assert {rules.rules[at] for at in projected} == {
        ("relation", "down"),
        ("class", "kitchen"),
        ("class", "hallway"),
    }
    assert not rules.project([])
