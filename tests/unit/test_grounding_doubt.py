"""What is asked, what short answers mean, and what they do to the readings."""

import math
from dataclasses import replace

import pytest

from services.grounding.answers import chosen, means_no, means_yes, reweighed, same
from services.grounding.model import GroundingModel
from services.grounding.questions import (
    Kind,
    Question,
    best_question,
    choice_question,
    entropy,
    sentence,
    word_questions,
)
from services.grounding.understanding import Understanding
from services.grounding.wording import corrected, introduces, resolved, substituted

MODEL = GroundingModel.load("husky")
SPLIT = "go to the hydrant near the cone behind the tree"


def masses(understanding: Understanding) -> tuple[float, float]:
    rest = understanding.other_mass
    intended = math.fsum(one.probability for one in understanding.intents)
    stated = math.fsum(one.probability for one in understanding.annotations)
    return intended + understanding.statement_mass + rest, stated + rest


@pytest.mark.parametrize("is_meant", [True, False])
@pytest.mark.parametrize("text", [SPLIT, "go to the cone", "the tree", "run", "paint the car"])
def test_after_an_answer_probabilities_still_sum_to_one(text: str, is_meant: bool) -> None:
    before = MODEL.understand(text)
    for asked in before.intents[:3]:
        assert masses(reweighed(before, asked, is_meant)) == pytest.approx((1.0, 1.0))


def test_yes_raises_the_asked_reading_and_no_lowers_it() -> None:
    before = MODEL.understand(SPLIT)
    for asked in before.intents[:2]:
        for is_meant in (True, False):
            after = reweighed(before, asked, is_meant)
            now = next(one for one in after.intents if same(one, asked))
            assert (now.probability > asked.probability) is is_meant


def test_two_yeses_make_an_unlikely_reading_the_best() -> None:
    before = MODEL.understand(SPLIT)
    asked = before.intents[1]
    after = reweighed(reweighed(before, asked, True), asked, True)
    assert same(after.intents[0], asked)
    stated = after.annotations[0].relations
    assert (asked.relation, asked.object, asked.landmark) in stated


@pytest.mark.parametrize(
    "text",
    [
        "go to the hydrant behind the cone",
        "drive safely to the tree left of the car",
        "go to the cone nearest to the building",
        "go behind the car",
        "go to the wall in front of the barrel",
        "go to the cone",
    ],
)
def test_a_reading_in_words_is_understood_as_the_same_again(text: str) -> None:
    best = MODEL.understand(text).intents[0]
    assert same(MODEL.understand(sentence(best)).intents[0], best)


def test_a_similar_word_is_asked_with_yes_or_no_and_a_strange_one_as_a_choice() -> None:
    def asked(text: str) -> Question:
        questions = word_questions(MODEL.understand(text), MODEL.lexicon, {})
        best = best_question(questions, ())
        assert best is not None
        return best

    assert asked("go to the hydra").text == 'By "hydra" do you mean a hydrant?'
    assert asked("go to the hydra").options == ("yes", "no")
    assert asked("go to the gizmo").kind is Kind.WORD
    assert len(asked("go to the gizmo").options) == 4


def test_what_was_refused_or_asked_is_not_asked_again() -> None:
    understanding = MODEL.understand("go to the hydra")
    first = best_question(word_questions(understanding, MODEL.lexicon, {}), ())
    assert first is not None
    later = word_questions(understanding, MODEL.lexicon, {"hydra": {"hydrant"}})
    assert all("hydrant" not in one.meanings for one in later)
    second = best_question(word_questions(understanding, MODEL.lexicon, {}), {first.text})
    assert second is not None
    assert second.text != first.text


def test_gain_is_entropy_less_cost() -> None:
    even = Question(Kind.CHOICE, "", "", ("a", "b"), (0.5, 0.5))
    sure = Question(Kind.CHOICE, "", "", ("a", "b"), (0.99, 0.01))
    assert even.gain == pytest.approx(math.log(2) - 0.3)
    assert sure.gain < 0.0
    assert best_question([sure, even], ()) is even
    assert best_question([sure], ()) is None
    assert entropy((1.0, 0.0)) == 0.0


@pytest.mark.parametrize("text", ["yes", "Yeah!", "yes please", "y", "that one? sure"[-4:], "OK."])
def test_ways_to_say_yes(text: str) -> None:
    assert means_yes(text)
    assert not means_no(text)


@pytest.mark.parametrize("text", ["no", "Nope.", "no, thanks", "none of them", "n"])
def test_ways_to_say_no(text: str) -> None:
    assert means_no(text)
    assert not means_yes(text)


CHOICE = choice_question(
    tuple(
        replace(MODEL.understand(text).intents[0], probability=0.4)
        for text in ("go to the hydrant behind the cone", "go to the hydrant near the wall")
    )
)


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("the one behind the cone", 0),
        ("the one near the wall", 1),
        ("the second one", 1),
        ("1", 0),
        ("Near the wall.", 1),
        ("go to the hydrant behind the cone", 0),
        ("the hydrant", None),
        ("yes", None),
        ("no", None),
        ("something else", None),
        ("", None),
    ],
)
def test_short_answers_pick_an_option(text: str, number: int | None) -> None:
    wanted = None if number is None else CHOICE.meanings[number]
    assert chosen(CHOICE, text) == wanted


def test_turns_of_speech() -> None:
    assert corrected("no, the one behind the tree") == "the one behind the tree"
    assert corrected("I meant the cone") == "the cone"
    assert corrected("not that one, the other one") == "the other one"
    assert corrected("the one behind the tree") == "the one behind the tree"
    assert corrected("go to the north wall") is None
    assert corrected("notice the wall") is None
    assert resolved("the one behind it", "hydrant") == "the hydrant behind the hydrant"
    assert introduces("There is a hydrant behind the building")
    assert introduces("a hydrant is behind the building")
    assert not introduces("the hydrant is near the building")
    assert substituted("Zoom over to the Pylon", {"zoom": "go to", "pylon": "cone"}) == (
        "go over to the cone"
    )
    assert substituted("zoom the pylons", {"zoom": "go to", "pylon": "cone"}) == "go to the pylons"
