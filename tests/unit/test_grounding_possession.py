"""Clauses about a thing: what one sees there, what it has and what it contains."""

import pytest

from services.grounding.corpus import CORPORA, read_corpus
from services.grounding.explanation import read_phrases
from services.grounding.model import GroundingModel
from services.grounding.possession import spelled_out
from services.grounding.tree import parse_bracket

HUSKY, ARM = GroundingModel.load("husky"), GroundingModel.load("husky_ur5")


@pytest.mark.parametrize(
    ("model", "text", "goal", "relation"),
    [
        (HUSKY, "drive to the barrel you see in front of the wall", "barrel", "front barrel wall"),
        (HUSKY, "go to the tree you can see near the car", "tree", "near tree car"),
        (HUSKY, "go to the car with a barrel behind it", "car", "back barrel car"),
        (HUSKY, "approach the tree having a cone to the left of it", "tree", "left cone tree"),
        (
            ARM,
            "pick up the banana you will find in the suitcase",
            "banana",
            "inside banana suitcase",
        ),
        (ARM, "grab the pitcher that has a cone next to it", "pitcher", "near cone pitcher"),
        (ARM, "go to the suitcase that contains the banana", "suitcase", "inside banana suitcase"),
        (ARM, "lift the box holding the pitcher", "box", "inside pitcher box"),
        (ARM, "the suitcase holds a drill", None, "inside drill suitcase"),
        (ARM, "there is a box that contains the ball", None, "inside ball box"),
    ],
)
def test_clause_relates_its_head_noun(
    model: GroundingModel, text: str, goal: str | None, relation: str
) -> None:
    found = model.understand(text)
    best = found.annotations[0]
    assert found.understood
    assert best.relations == (tuple(relation.split()),)
    assert best.objects == tuple(sorted(relation.split()[1:]))
    assert best.probability > 0.6
    assert (found.intents[0].object if goal else None) == goal
    assert (found.statement_mass > 0.9) == (goal is None)


def test_it_outside_of_what_a_thing_has_is_left_alone() -> None:
    tree = parse_bracket(
        "(NP (NP (DT the) (NN cone)) (SBAR (WDT that) (VP (VBZ is) (PP (IN near) (NP (PRP it))))))"
    )
    assert spelled_out(tree) == tree


def test_corpora_keep_their_shape() -> None:
    for one in read_corpus(CORPORA / "husky_ur5.txt", ARM.table):
        assert len(tuple(spelled_out(one.tree).preorder())) == len(one.symbols), one.text


@pytest.mark.parametrize("text", ["the box holds a drill", "the box has a drill in it"])
def test_explanation_reads_what_inference_reads(text: str) -> None:
    readings = read_phrases(ARM, ARM.understand(text))
    assert set(readings[0].best) == {"box", "inside(drill, box)"}
    assert [one.phrase for one in readings] == list(readings[0].phrase.preorder())
