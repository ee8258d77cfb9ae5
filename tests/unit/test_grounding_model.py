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


WHEELCHAIR = GroundingModel.load("wheelchair")
ARM = GroundingModel.load("husky_ur5")


@pytest.mark.parametrize(
    ("model", "text", "wanted"),
    [
        (ARM, "retrieve the ball inside the box", ("retrieve", "ball", "inside", "box")),
        (ARM, "pick the drill up", ("pick", "drill", "unknown", "unknown")),
        (ARM, "bring me the banana from the lab", ("retrieve", "banana", "inside", "lab")),
        (ARM, "get to the office", ("navigate", "office", "unknown", "unknown")),
        (ARM, "grab the cracker box in the hallway", ("pick", "cracker box", "inside", "hallway")),
        (
            WHEELCHAIR,
            "go to the kitchen that is down the hallway",
            ("navigate", "kitchen", "down", "hallway"),
        ),
        (WHEELCHAIR, "go down the hallway", ("navigate", "robot", "down", "hallway")),
        (WHEELCHAIR, "turn left", ("left", "robot", "unknown", "unknown")),
        (WHEELCHAIR, "take a right", ("right", "robot", "unknown", "unknown")),
        (
            WHEELCHAIR,
            "take me to the conference room past the elevator",
            ("navigate", "conference room", "past", "elevator"),
        ),
    ],
)
def test_actions_and_places_of_the_other_robots(
    model: GroundingModel, text: str, wanted: tuple[str, str, str, str]
) -> None:
    understanding = model.understand(text)
    best = understanding.intents[0]
    assert understanding.understood
    assert (best.action, best.object, best.relation, best.landmark) == wanted
    assert model.behaviors(understanding).behaviors[0].action == wanted[0]


def test_locations_are_figures_and_landmarks_of_annotations() -> None:
    found = WHEELCHAIR.understand("the kitchen is down the hallway").annotations[0]
    assert found.objects == ("hallway", "kitchen")
    assert found.relations == (("down", "kitchen", "hallway"),)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("go to the cone and then to the tree", ["cone", "tree"]),
        ("go to the cone and then drive to the car behind the tree", ["cone", "car"]),
        ("there is a cone near the car and go to it", ["cone"]),
        ("go to the hydrant behind the cone", ["hydrant"]),
        ("there is a hydrant", []),
    ],
)
def test_steps_are_done_in_order_and_the_first_is_the_intent(text: str, steps: list[str]) -> None:
    understanding = MODEL.understand(text)
    assert [one.object for one in understanding.steps] == steps
    if steps:
        assert understanding.intents[0] == understanding.steps[0]
        assert set(steps) <= set(understanding.annotations[0].objects)


def test_correction_is_marked_and_what_is_taken_back_is_not_said() -> None:
    found = MODEL.understand("no, the one behind the tree")
    assert found.correction
    found = MODEL.understand("not the cone, the hydrant")
    assert found.correction
    assert found.annotations[0].objects == ("hydrant",)
    assert not MODEL.understand("go to the hydrant").correction
