"""Laws of the conversation: what is asked, what answers do, and what stays said."""

import itertools
import math
from dataclasses import replace

import pytest

from services.grounding.conformal import ConformalSet, load_conformal
from services.grounding.dialogue import MAX_QUESTIONS, PATIENCE_S, Dialogue
from services.grounding.model import GroundingModel
from services.grounding.questions import Kind
from services.grounding.scene import Scene, Thing
from services.grounding.talk import Meaning, acts
from services.grounding.understanding import Intent, Understanding

MODEL = GroundingModel.load("husky")
CONE, HYDRANT = Thing(1, "cone", 5.0, 0.0, 0.0), Thing(2, "hydrant", 6.0, 0.5, 0.5)
WALL, OTHER = Thing(3, "wall", 5.0, 9.0, 0.0), Thing(4, "hydrant", 6.0, 8.0, 0.4)


def dialogue(conformal: ConformalSet | None = None) -> Dialogue:
    return Dialogue(MODEL.understand, MODEL.lexicon, conformal or load_conformal("husky"))


def best(meaning: Meaning | None) -> Intent:
    assert meaning is not None
    return meaning.understanding.intents[0]


def goal(meaning: Meaning | None) -> tuple[str, str, str]:
    one = best(meaning)
    return one.relation, one.object, one.landmark


def assert_sums_to_one(meaning: Meaning) -> None:
    one = meaning.understanding
    intended = math.fsum(intent.probability for intent in one.intents)
    stated = math.fsum(annotation.probability for annotation in one.annotations)
    assert intended + one.statement_mass + one.other_mass == pytest.approx(1.0)
    assert stated + one.other_mass == pytest.approx(1.0)


SAID = [
    "there is a hydrant behind the building",
    "the building is near the tree",
    "there is a hydrant near the car",
    "go to the hydrant",
    "the hydrant is left of the wall",
    "no, the one behind the tree",
    "go to the pylon near the barrel",
]


@pytest.mark.parametrize("pair", list(itertools.permutations(SAID, 2)))
def test_all_masses_sum_to_one_whatever_was_said_before(pair: tuple[str, str]) -> None:
    talk = dialogue()
    for number, text in enumerate((*pair, "go to the hydrant")):
        for meaning in talk.hear(f"i{number}", text, f"i{number - 1}"):
            assert_sums_to_one(meaning)


def test_what_is_clear_is_acted_on_without_a_question() -> None:
    (meaning,) = dialogue().hear("a", "go to the hydrant behind the cone")
    assert meaning.understanding.understood
    assert meaning.question is None
    assert goal(meaning) == ("back", "hydrant", "cone")


def test_an_earlier_statement_says_where_the_goal_is() -> None:
    talk = dialogue()
    talk.hear("a", "there is a hydrant behind the building")
    (meaning,) = talk.hear("b", "go to the hydrant")
    assert goal(meaning) == ("back", "hydrant", "building")
    assert 0.8 < best(meaning).probability < 0.95
    assert meaning.viewpoint == "a"
    plain = meaning.understanding.intents[1]
    assert plain.relation == "unknown"


def test_an_earlier_statement_does_not_overrule_the_instruction_itself() -> None:
    talk = dialogue()
    talk.hear("a", "there is a hydrant behind the building")
    (meaning,) = talk.hear("b", "go to the hydrant near the tree")
    assert meaning.understanding.annotations[0].relations == (("near", "hydrant", "tree"),)


def test_a_statement_moves_nothing_and_revises_what_runs() -> None:
    talk = dialogue()
    talk.hear("a", "go to the hydrant behind the cone")
    noted, revised = talk.hear("b", "the hydrant is near the building", "a")
    assert noted.revises == "a"
    assert not acts(noted.understanding)
    assert (revised.instruction_id, revised.revision) == ("a", 1)
    assert goal(revised) == ("back", "hydrant", "cone")
    assert revised.understanding.annotations[0].relations == (
        ("back", "hydrant", "cone"),
        ("near", "hydrant", "building"),
    )


def test_a_statement_about_something_else_changes_nothing_that_runs() -> None:
    talk = dialogue()
    talk.hear("a", "go to the hydrant behind the cone")
    (noted,) = talk.hear("b", "the car is near the building", "a")
    assert not acts(noted.understanding)
    assert noted.understanding.understood


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("no, the one behind the tree", ("back", "hydrant", "tree")),
        ("the one near the car", ("near", "hydrant", "car")),
        ("no, behind the wall", ("back", "hydrant", "wall")),
        ("I mean the hydrant left of the building", ("left", "hydrant", "building")),
        ("actually go to the barrel", ("unknown", "barrel", "unknown")),
        ("no, the barrel", ("unknown", "barrel", "unknown")),
    ],
)
def test_a_correction_gives_the_running_instruction_another_goal(
    text: str, wanted: tuple[str, str, str]
) -> None:
    talk = dialogue()
    talk.hear("a", "go to the hydrant behind the cone")
    noted, revised = talk.hear("b", text, "a")
    assert noted.revises == "a"
    assert noted.understanding.understood
    assert (revised.instruction_id, revised.revision) == ("a", 1)
    assert goal(revised) == wanted


def test_without_a_running_instruction_a_correction_is_a_new_one() -> None:
    talk = dialogue()
    talk.hear("a", "go to the hydrant behind the cone")
    (meaning,) = talk.hear("b", "no, the one behind the tree")
    assert meaning.instruction_id == "b"
    assert goal(meaning) == ("back", "hydrant", "tree")


def test_a_new_instruction_stands_on_its_own() -> None:
    talk = dialogue()
    talk.hear("a", "go to the hydrant behind the cone")
    (meaning,) = talk.hear("b", "go to the barrel", "a")
    assert (meaning.instruction_id, meaning.revises) == ("b", "")


def test_yes_to_an_unknown_word_makes_it_a_known_one_for_the_session() -> None:
    talk = dialogue()
    (meaning,) = talk.hear("a", "go to the hydra behind the cone")
    assert not meaning.understanding.understood
    assert meaning.question is not None
    assert meaning.question.text == 'By "hydra" do you mean a hydrant?'
    after = talk.answer("yes")
    assert goal(after) == ("back", "hydrant", "cone")
    assert after is not None
    assert after.understanding.understood
    assert (after.instruction_id, after.revision, after.question) == ("a", 1, None)
    (later,) = talk.hear("b", "go to the hydra")
    assert later.understanding.understood


@pytest.mark.parametrize("answer", ["a cone", "cone", "it's a cone", "the cone", "no, a cone"])
def test_a_class_word_answers_what_a_word_means(answer: str) -> None:
    talk = dialogue()
    talk.hear("a", "go to the gizmo near the tree")
    assert goal(talk.answer(answer)) == ("near", "cone", "tree")


def test_an_answer_may_be_a_whole_instruction_or_said_as_one() -> None:
    talk = dialogue()
    talk.hear("a", "go to the gizmo")
    assert goal(talk.answer("go to the hydrant near the tree")) == ("near", "hydrant", "tree")
    talk = dialogue()
    talk.hear("a", "go to the gizmo")
    noted, revised = talk.hear("b", "a cone", "a")
    assert (noted.revises, acts(noted.understanding)) == ("a", True)
    assert best(revised).object == "cone"


ANSWERS = ("no", "yes", "banana", "", "the sky", "what?")


@pytest.mark.parametrize(
    "text", ["go to the gizmo", "paint the cone", "go to the hydra near the gizmo", "xyzzy"]
)
@pytest.mark.parametrize("answers", list(itertools.product(ANSWERS, repeat=2)))
def test_never_more_than_two_questions_and_never_the_same_twice(
    text: str, answers: tuple[str, str]
) -> None:
    talk = dialogue()
    (meaning,) = talk.hear("a", text)
    asked: list[str] = []
    for answer in (*answers, "no", "no"):
        if meaning.question is not None and meaning.question.kind is not Kind.REPEAT:
            asked.append(meaning.question.text)
        told = talk.answer(answer)
        if told is None:
            break
        assert told.revision == meaning.revision + 1
        meaning = told
    assert len(asked) == len(set(asked)) <= MAX_QUESTIONS


def test_without_an_open_question_an_answer_says_nothing() -> None:
    talk = dialogue()
    talk.hear("a", "go to the cone")
    assert talk.answer("yes") is None
    talk.hear("b", "go to the gizmo")
    talk.close("b")
    assert talk.answer("cone") is None


@pytest.mark.parametrize("text", ["xyzzy", "paint the fence", "走到消防栓", ""])
def test_hopeless_texts_are_not_asked_about_word_by_word(text: str) -> None:
    (meaning,) = dialogue().hear("a", text)
    assert meaning.question is not None
    assert meaning.question.kind is Kind.REPEAT
    assert meaning.question.options == ()


def test_where_it_is_is_asked_once_after_looking_in_vain() -> None:
    talk = dialogue()
    talk.hear("a", "go to the hydrant")
    assert talk.look("a", (CONE,), PATIENCE_S - 1) is None
    asked = talk.look("a", (CONE,), PATIENCE_S + 1)
    assert asked is not None
    assert asked.question is not None
    assert asked.question.text == "Where is the hydrant?"
    assert asked.understanding.understood
    assert talk.look("a", (CONE,), PATIENCE_S + 2) is None
    answered = talk.answer("behind the building")
    assert goal(answered) == ("back", "hydrant", "building")
    assert talk.look("a", (CONE,), PATIENCE_S + 3) is None


@pytest.mark.parametrize("text", ["go to the hydrant behind the cone", "go to the wall"])
def test_nothing_is_asked_where_a_place_was_given_or_the_thing_is_seen(text: str) -> None:
    talk = dialogue()
    talk.hear("a", text)
    assert talk.look("a", (CONE, WALL), 10 * PATIENCE_S) is None


def test_two_things_that_fit_are_told_apart_by_what_stands_beside_them() -> None:
    talk = dialogue(ConformalSet(0.7, 39))
    talk.hear("a", "go to the hydrant")
    scene: Scene = (CONE, HYDRANT, WALL, OTHER)
    asked = talk.look("a", scene, 3.0)
    assert asked is not None
    assert asked.question is not None
    assert asked.question.text == (
        "Do you mean the hydrant near the cone or the hydrant near the wall?"
    )
    assert asked.understanding.understood
    answered = talk.answer("the one near the wall")
    assert answered is not None
    assert answered.not_meant == (HYDRANT.node,)
    assert goal(answered) == ("unknown", "hydrant", "unknown")
    assert talk.look("a", scene, 4.0) is None


def test_of_two_things_the_one_with_nothing_beside_it_is_the_other() -> None:
    talk = dialogue(ConformalSet(0.7, 39))
    talk.hear("a", "go to the hydrant")
    asked = talk.look("a", (CONE, HYDRANT, OTHER), 3.0)
    assert asked is not None
    assert asked.question is not None
    assert asked.question.options == ("go to the hydrant near the cone", "go to the other hydrant")
    answered = talk.answer("the other one")
    assert answered is not None
    assert answered.not_meant == (HYDRANT.node,)


def test_things_that_cannot_be_told_apart_in_words_are_not_asked_about() -> None:
    talk = dialogue(ConformalSet(0.7, 39))
    talk.hear("a", "go to the hydrant")
    far = replace(OTHER, x=30.0)
    assert talk.look("a", (replace(CONE, x=60.0), HYDRANT, far), 3.0) is None


def asked_about_the_only_one(mass: float) -> tuple[Dialogue, Meaning | None]:
    talk = dialogue()
    talk.hear("a", "go to the hydrant")
    return talk, talk.look("a", (CONE, replace(HYDRANT, mass=mass)), 3.0)


def test_the_only_one_that_was_seen_is_asked_about_where_another_may_be_meant() -> None:
    talk, asked = asked_about_the_only_one(mass=0.8)
    assert asked is not None
    assert asked.question is not None
    assert asked.question.text == "Do you mean the hydrant that I see now?"
    assert asked.question.options == ("yes", "no")
    answered = talk.answer("no")
    assert answered is not None
    assert answered.not_meant == (HYDRANT.node,)
    assert answered.understanding.understood
    assert talk.look("a", (CONE, replace(HYDRANT, mass=0.0)), 4.0) is None


def test_nothing_is_asked_about_a_thing_that_is_meant_almost_surely() -> None:
    _, asked = asked_about_the_only_one(mass=0.95)
    assert asked is None


def test_after_a_yes_nothing_more_is_asked() -> None:
    talk, _ = asked_about_the_only_one(mass=0.8)
    answered = talk.answer("yes")
    assert answered is not None
    assert answered.not_meant == ()
    assert talk.look("a", (CONE, HYDRANT, OTHER, WALL), 4.0) is None


def test_where_it_is_need_not_be_answered_once_one_is_seen() -> None:
    talk = dialogue()
    talk.hear("a", "go to the hydrant")
    talk.look("a", (CONE,), PATIENCE_S + 1)
    asked = talk.look("a", (CONE, replace(HYDRANT, mass=0.8)), PATIENCE_S + 2)
    assert asked is not None
    assert asked.question is not None
    assert asked.question.kind is Kind.REFERENT


def test_of_two_things_the_much_likelier_one_needs_no_question() -> None:
    talk = dialogue(ConformalSet(0.3, 39))
    talk.hear("a", "go to the hydrant")
    unlikely, likely = replace(OTHER, mass=0.05), replace(HYDRANT, mass=0.95)
    assert talk.look("a", (CONE, likely, WALL, unlikely), 3.0) is None


def test_readings_with_different_goals_are_asked_about_and_a_place_is_left_to_the_map() -> None:
    talk = dialogue(ConformalSet(0.95, 39))
    (meaning,) = talk.hear("a", "go to the hydrant near the cone behind the tree")
    assert meaning.question is None


@pytest.mark.parametrize(
    "steps",
    [
        ["there is a hydrant behind the building", "go to the hydrant"],
        ["go to the hydrant behind the cone", "no, the one behind the tree"],
        ["go to the hydra near the gizmo", "=yes", "=tree"],
        ["go to the gizmo", "=no", "=barrel"],
        ["go to the cone", "=?", "=behind the building"],
        ["go to the hydrant", "the hydrant is near the car"],
    ],
)
def test_a_killed_process_takes_the_conversation_up(steps: list[str]) -> None:
    talk, running = dialogue(), ""
    for number, step in enumerate(steps):
        if step == "=?":
            talk.look(running, (), 2 * PATIENCE_S)
        elif step.startswith("="):
            talk.answer(step[1:])
        else:
            said = talk.hear(f"i{number}", step, running)
            running = f"i{number}" if not said[0].revises else running
    heir = dialogue()
    heir.restore(talk.said, 7)
    mine, its = talk.meaning_of(running), heir.meaning_of(running)
    assert mine is not None
    assert its is not None
    assert its.understanding == mine.understanding
    assert its.question == mine.question
    assert its.revision == 7
    assert heir.said == talk.said


def test_whoever_says_where_it_is_need_not_say_that_it_is_an_answer() -> None:
    talk = dialogue()
    talk.hear("a", "go to the hydrant")
    talk.look("a", (), 2 * PATIENCE_S)
    noted, revised = talk.hear("b", "behind the building", "a")
    assert noted.revises == "a"
    assert goal(revised) == ("back", "hydrant", "building")


def test_an_answer_finds_its_question_while_something_else_runs() -> None:
    talk = dialogue()
    talk.hear("a", "go to the hydrant behind the cone")
    talk.hear("b", "go to the gizmo", "a")
    noted, revised = talk.hear("c", "a barrel", "a")
    assert (noted.revises, revised.instruction_id) == ("b", "b")
    assert best(revised).object == "barrel"


def split_dialogue() -> Dialogue:
    """Of one sentence nobody knows whether it means the cone or the tree."""
    cone, tree = MODEL.understand("go to the cone"), MODEL.understand("go to the tree")

    def understand(text: str) -> Understanding:
        if text != "go there":
            return MODEL.understand(text)
        return replace(
            cone,
            text=text,
            intents=(
                replace(cone.intents[0], probability=0.5),
                replace(tree.intents[0], probability=0.4),
            ),
            annotations=(
                replace(cone.annotations[0], probability=0.55),
                replace(tree.annotations[0], probability=0.4),
            ),
            statement_mass=0.05,
            other_mass=0.05,
        )

    return Dialogue(understand, MODEL.lexicon, ConformalSet(0.7, 39))


@pytest.mark.parametrize(
    ("answer", "wanted"),
    [("the tree", "tree"), ("2", "tree"), ("the first one", "cone"), ("go to the car", "car")],
)
def test_what_may_mean_two_things_waits_for_a_choice(answer: str, wanted: str) -> None:
    talk = split_dialogue()
    (meaning,) = talk.hear("a", "go there")
    assert not meaning.understanding.understood
    assert meaning.question is not None
    assert meaning.question.text == "Do you mean go to the cone or go to the tree?"
    after = talk.answer(answer)
    assert after is not None
    assert after.understanding.understood
    assert after.question is None
    assert best(after).object == wanted
    assert best(after).probability > 0.9
    assert_sums_to_one(after)


def test_who_wants_neither_is_not_asked_the_same_again() -> None:
    talk = split_dialogue()
    talk.hear("a", "go there")
    after = talk.answer("neither")
    assert after is not None
    assert after.question is None
    assert not after.understanding.understood
    assert_sums_to_one(after)
