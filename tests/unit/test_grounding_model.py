"""Annotation inference: the sentences that must work, and text that must do no harm."""

import math
import time

import pytest

from services.grounding.corpus import CORPORA, HeldOut, read_corpus, read_held_out
from services.grounding.model import GroundingModel
from services.grounding.report import document
from services.grounding.understanding import Understanding

MODEL = GroundingModel.load("husky")
HELD_OUT = read_held_out(CORPORA / "husky.heldout.txt", MODEL.table)
MAX_ANSWER_S = 1.0

STRANGE = [
    "",
    "   ",
    "!!! ... ???",
    "\U0001f692\U0001f9ef",
    "\x00\x07\x1b\x7f",
    "走到消防栓",
    "иди к гидранту",
    "اذهب إلى",
    "İstanbul ﬁre 'S s's",
    "a" * 10_000,
    "go to the cone " * 667,
    "the hydrant " + "that is behind the cone " * 300,
    "go to the hydrant behind " + "the cone behind " * 7 + "the tree",
    "go " * 40,
]


def acts(understanding: Understanding) -> bool:
    best = understanding.intents[:1]
    return bool(best) and best[0].probability > understanding.statement_mass


@pytest.mark.parametrize("example", HELD_OUT, ids=lambda example: example.text)
def test_held_out_sentence_is_read_exactly(example: HeldOut) -> None:
    readings = MODEL.readings(example.text)
    assert max(readings, key=lambda symbols: readings[symbols]) == example.symbols


def test_no_held_out_sentence_is_in_the_corpus() -> None:
    seen = {one.text for one in read_corpus(CORPORA / "husky.txt", MODEL.table)}
    assert not seen & {one.text for one in HELD_OUT}


def test_contract_example() -> None:
    understanding = MODEL.understand("go to the hydrant behind the cone")
    found = document("husky", understanding, MODEL.behaviors(understanding), 1.0)
    assert list(found) == [
        "text",
        "robot",
        "understood",
        "parse",
        "parse_probability",
        "annotations",
        "behaviors",
        "unknown_words",
        "question",
        "elapsed_ms",
    ]
    assert found["understood"] is True
    assert found["question"] is None
    annotation, behavior = found["annotations"][0], found["behaviors"][0]
    assert annotation.pop("probability") > 0.9
    assert behavior.pop("probability") > 0.9
    assert annotation == {
        "objects": ["cone", "hydrant"],
        "relations": [{"relation": "back", "figure": "hydrant", "landmark": "cone"}],
    }
    assert behavior == {
        "action": "navigate",
        "object": "hydrant",
        "mode": "unknown",
        "relation": "back",
        "landmark": "cone",
    }


def test_nearest_is_near_with_the_comparative_kept() -> None:
    best = MODEL.understand("go to the hydrant nearest to the cone").intents[0]
    assert (best.relation, best.landmark, best.comparative) == ("near", "cone", True)
    assert not MODEL.understand("go to the hydrant near the cone").intents[0].comparative


def test_statement_has_annotations_and_no_behavior() -> None:
    understanding = MODEL.understand("there is a hydrant behind the building")
    assert understanding.understood
    assert understanding.annotations[0].relations == (("back", "hydrant", "building"),)
    assert not MODEL.behaviors(understanding).behaviors


def test_unknown_words_are_named_and_nothing_is_done() -> None:
    understanding = MODEL.understand("paint the fence")
    assert not understanding.understood
    assert understanding.unknown_words == ("paint", "fence")
    assert understanding.question
    assert any("hydrant" in line for line in understanding.possible)
    assert not MODEL.behaviors(understanding).behaviors


def test_unknown_landmark_needs_an_answer() -> None:
    understanding = MODEL.understand("go to the hydrant behind the pylon")
    assert not understanding.understood
    assert understanding.unknown_words == ("pylon",)


def test_nearest_known_words_are_offered() -> None:
    understanding = MODEL.understand("go to the hydra")
    assert "hydrant" in understanding.suggestions["hydra"]
    assert understanding.question
    assert "hydrant" in understanding.question


def test_negated_command_does_nothing() -> None:
    understanding = MODEL.understand("do not go to the cone")
    assert not acts(understanding)
    assert not MODEL.behaviors(understanding).behaviors


@pytest.mark.parametrize("text", STRANGE, ids=range(len(STRANGE)))
def test_any_text_gets_an_answer_in_time(text: str) -> None:
    started = time.perf_counter()
    understanding = MODEL.understand(text)
    MODEL.behaviors(understanding)
    assert time.perf_counter() - started < MAX_ANSWER_S
    assert not understanding.understood
    assert understanding.question


@pytest.mark.parametrize("text", [*STRANGE, *(one.text for one in HELD_OUT[:12])])
def test_masses_sum_to_one(text: str) -> None:
    one = MODEL.understand(text)
    annotated = math.fsum(a.probability for a in one.annotations)
    intended = math.fsum(i.probability for i in one.intents)
    assert annotated + one.other_mass == pytest.approx(1.0)
    assert intended + one.statement_mass + one.other_mass == pytest.approx(1.0)
    probabilities = [a.probability for a in one.annotations]
    assert probabilities == sorted(probabilities, reverse=True)


def test_equal_sentences_equal_answers() -> None:
    text = "drive to the barrel near the tree"
    first = MODEL.understand(text)
    MODEL.understand("go to the hydrant behind the cone")
    assert MODEL.understand(text) == first
    assert GroundingModel.load("husky").understand(text) == first
