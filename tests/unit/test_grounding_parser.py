"""The parser reads instructions as the contract writes them, and never fails."""

import math

import pytest

from robots.catalogue import get_robot
from services.grounding.errors import GroundingError
from services.grounding.grammar import Grammar
from services.grounding.lexicon import Lexicon, is_one_slip
from services.grounding.parser import Parse, parse
from services.grounding.text import tokenize
from services.grounding.tree import parse_bracket

LEXICON = Lexicon.load(get_robot("husky").symbols)
GRAMMAR = Grammar.load()


def parses(text: str) -> tuple[Parse, ...]:
    return parse(LEXICON.strip_fillers(tokenize(text)), LEXICON, GRAMMAR)


def test_contract_tree() -> None:
    tree = (
        "(VP (VB go) (PP (TO to) (NP (NP (DT the) (NN hydrant)) "
        "(PP (IN behind) (NP (DT the) (NN cone))))))"
    )
    assert parses("go to the hydrant behind the cone")[0].tree.bracket() == tree


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("go to the fire hydrant", "(NN fire_hydrant)"),
        ("go to the cone in front of the car", "(PP (IN in_front_of) (NP (DT the) (NN car)))"),
        ("go to the hydrant that is behind the cone", "(SBAR (WDT that) (VP (VBZ is)"),
        ("go to the hydrant nearest to the cone", "(ADJP (JJS nearest) (PP (TO to)"),
        ("there is a hydrant behind the wall", "(S (NP (EX there)) (VP (VBZ is)"),
        ("drive quickly to the cone", "(VP (VB drive) (ADVP (RB quickly)) (PP"),
    ],
)
def test_constructions(text: str, part: str) -> None:
    best = parses(text)[0]
    assert not best.partial
    assert part in best.tree.bracket()


def test_place_attaches_to_the_nearest_noun_and_the_other_tree_is_kept() -> None:
    first, *rest = parses("go to the hydrant behind the cone near the tree")
    assert "(NP (NP (DT the) (NN cone)) (PP (IN near)" in first.tree.bracket()
    assert any("(NP (NP (NP (DT the) (NN hydrant))" in one.tree.bracket() for one in rest)


def test_posteriors_are_sorted_and_sum_to_at_most_one() -> None:
    found = parses("move to the tree to the left of the building near the car quickly")
    probabilities = [one.probability for one in found]
    assert probabilities == sorted(probabilities, reverse=True)
    assert 0.9 < math.fsum(probabilities) <= 1.0 + 1e-9
    assert len({one.tree for one in found}) == len(found)


def test_politeness_changes_nothing() -> None:
    plain = parses("go to the cone")
    assert parses("Could you please go to the cone, thanks!") == plain


@pytest.mark.parametrize("text", ["cone hydrant the go", "the", "zork of of", "behind behind"])
def test_what_the_grammar_lacks_becomes_fragments(text: str) -> None:
    (found,) = parses(text)
    assert found.partial
    assert found.tree.surface.split() == text.split()


def test_bracket_notation_round_trip() -> None:
    for one in parses("go to the hydrant that is behind the cone near the tree"):
        assert parse_bracket(one.tree.bracket()) == one.tree


@pytest.mark.parametrize("text", ["", "(NP", "(NP)", "(NN cone)", "(NP (NN cone)) x", "NP (NN a)"])
def test_bad_brackets_say_so(text: str) -> None:
    with pytest.raises(GroundingError):
        parse_bracket(text)


def test_one_typing_slip_is_read_as_the_word() -> None:
    assert "(NN hydrant)" in parses("go to the hydrnat")[0].tree.bracket()


@pytest.mark.parametrize(
    ("a", "b", "slip"),
    [
        ("barrel", "barrel", False),
        ("barel", "barrel", True),
        ("barrrel", "barrel", True),
        ("berrel", "barrel", True),
        ("abrrel", "barrel", True),
        ("brarle", "barrel", False),
        ("barrels", "barre", False),
    ],
)
def test_damerau_distance_one(a: str, b: str, slip: bool) -> None:
    assert is_one_slip(a, b) is slip
    assert is_one_slip(b, a) is slip
