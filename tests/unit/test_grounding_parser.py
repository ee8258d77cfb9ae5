"""The parser reads instructions as the grammar's conventions say, and never fails."""

import math
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.symbols import get_symbols
from services.grounding.grammar import Grammar
from services.grounding.lexicon import Lexicon
from services.grounding.parser import Parse, parse
from services.grounding.text import tokenize
from services.grounding.tree import parse_bracket

GRAMMAR = Grammar.load()
LEXICA = {name: Lexicon.load(get_symbols(name)) for name in ("husky", "wheelchair", "husky_ur5")}
MAX_PARSE_S = 1.0


def parses(text: str, robot: str = "husky") -> tuple[Parse, ...]:
    lexicon = LEXICA[robot]
    return parse(lexicon.strip_fillers(tokenize(text)), lexicon, GRAMMAR)


def bracket(text: str, robot: str = "husky") -> str:
    return parses(text, robot)[0].tree.bracket()


CONE, TREE, HYDRANT = (
    "(NP (DT the) (NN cone))",
    "(NP (DT the) (NN tree))",
    "(NP (DT the) (NN hydrant))",
)
BALL, BOX = "(NP (DT the) (NN ball))", "(NP (DT the) (NN box))"
TO_CONE, TO_TREE = f"(PP (TO to) {CONE})", f"(PP (TO to) {TREE})"
BEHIND_TREE, IN_BOX = f"(PP (IN behind) {TREE})", f"(PP (IN in) {BOX})"
GO_TO_CONE = f"(VP (VB go) {TO_CONE})"
A_HYDRANT = "(VP (VBZ is) (NP (DT a) (NN hydrant)))"

OUTDOORS = [
    ("go to the cone behind the tree", f"(VP (VB go) (PP (TO to) (NP {CONE} {BEHIND_TREE})))"),
    ("would you mind going to the cone", GO_TO_CONE),
    ("I want you to go to the cone, please", GO_TO_CONE),
    ("uh, okay now go to, um, the cone", GO_TO_CONE),
    ("husky, go to the cone", f"(VP (VOC husky) (VB go) {TO_CONE})"),
    (
        "find the cone that's behind the tree",
        f"(VP (VB find) (NP {CONE} (SBAR (WDT that) (VP (VBZ is) {BEHIND_TREE}))))",
    ),
    ("the one behind the tree", f"(NP (NP (DT the) (NN one)) {BEHIND_TREE})"),
    ("the cone nearest to the tree", f"(NP {CONE} (ADJP (JJS nearest) {TO_TREE}))"),
    ("the closest cone", "(NP (DT the) (ADJP (JJS closest)) (NN cone))"),
    ("the cone to your left", f"(NP {CONE} (PP (TO to) (NP (DT your) (NN left))))"),
    ("the big red cone", "(NP (DT the) (ADJP (JJ big) (JJ red)) (NN cone))"),
    ("the two traffic cones", "(NP (DT the) (CD two) (NN traffic_cone))"),
    ("drive there safely", "(VP (VB drive) (ADVP (RB there)) (ADVP (RB safely)))"),
    ("be careful and go to the cone", f"(VP (ADVP (RB be_careful)) (VB go) {TO_CONE})"),
    ("go to the cone and then to the tree", f"(VP (VB go) (PP {TO_CONE} (CC and_then) {TO_TREE}))"),
    (
        "go to the cone, then drive to the tree",
        f"(VP {GO_TO_CONE} (CC then) (VP (VB drive) {TO_TREE}))",
    ),
    ("drive past the cone to the tree", f"(VP (VB drive) (PP (IN past) {CONE}) {TO_TREE})"),
    ("there is a hydrant", f"(S (NP (EX there)) {A_HYDRANT})"),
    ("behind the tree there is a hydrant", f"(S {BEHIND_TREE} (NP (EX there)) {A_HYDRANT})"),
    ("the cone's behind the tree", f"(S {CONE} (VP (VBZ is) {BEHIND_TREE}))"),
    ("no, the cone behind the tree", f"(CORR (UH no) (NP {CONE} {BEHIND_TREE}))"),
    ("I mean the cone", f"(CORR (UH i_mean) {CONE})"),
    ("not the cone, the hydrant", f"(CORR (NEG (RB not) {CONE}) {HYDRANT})"),
    ("don't go to the cone", f"(VP (RB do_not) {GO_TO_CONE})"),
]
INDOORS = [
    ("turn left", "(VP (VB turn_left))"),
    (
        "take me to the conference room",
        "(VP (VB take_me) (PP (TO to) (NP (DT the) (NN conference_room))))",
    ),
    (
        "down the hallway is the kitchen",
        "(S (PP (IN down) (NP (DT the) (NN hallway))) (VP (VBZ is) (NP (DT the) (NN kitchen))))",
    ),
    (
        "you will find the kitchen down the hallway",
        "(S (NP (EX you)) (VP (VBZ will_find) (NP (NP (DT the) (NN kitchen)) "
        "(PP (IN down) (NP (DT the) (NN hallway))))))",
    ),
]
HANDLING = [
    ("pick up the ball", f"(VP (VB pick) (RP up) {BALL})"),
    ("pick the ball up", f"(VP (VB pick) {BALL} (RP up))"),
    ("get me the ball", f"(VP (VB get) (NP (PRP me)) {BALL})"),
    (
        "bring me the ball from the box",
        f"(VP (VB bring) (NP (PRP me)) {BALL} (PP (IN from) {BOX}))",
    ),
    ("take the ball out of the box", f"(VP (VB take) {BALL} (PP (IN out_of) {BOX}))"),
    ("go get the ball", f"(VP (AUX go) (VB get) {BALL})"),
    ("I left the ball in the box", f"(S (NP (PRP i)) (VP (VBD left) (NP {BALL} {IN_BOX})))"),
    (
        "the box with the ball in it",
        f"(NP {BOX} (PP (IN with) (NP {BALL} (PP (IN in) (NP (PRP it))))))",
    ),
]
CONSTRUCTIONS = [
    *(("husky", *pair) for pair in OUTDOORS),
    *(("wheelchair", *pair) for pair in INDOORS),
    *(("husky_ur5", *pair) for pair in HANDLING),
]


def test_contract_tree() -> None:
    tree = (
        "(VP (VB go) (PP (TO to) (NP (NP (DT the) (NN hydrant)) "
        "(PP (IN behind) (NP (DT the) (NN cone))))))"
    )
    assert bracket("go to the hydrant behind the cone") == tree


@pytest.mark.parametrize(("robot", "text", "expected"), CONSTRUCTIONS)
def test_constructions(robot: str, text: str, expected: str) -> None:
    assert bracket(text, robot) == expected


def test_place_attaches_to_the_nearest_noun_and_the_other_tree_is_kept() -> None:
    first, *rest = parses("go to the hydrant behind the cone near the tree")
    assert "(NP (NP (DT the) (NN cone)) (PP (IN near)" in first.tree.bracket()
    assert any("(NP (NP (NP (DT the) (NN hydrant))" in one.tree.bracket() for one in rest)


@pytest.mark.parametrize(
    "text",
    [
        "move to the tree to the left of the building near the car quickly",
        "go to the cone that is behind the tree that is near the wall and then to the car",
        "go to the hydrant, not the cone",
    ],
)
def test_posteriors_are_sorted_and_sum_to_one_less_the_trees_left_out(text: str) -> None:
    found = parses(text)
    probabilities = [one.probability for one in found]
    assert probabilities == sorted(probabilities, reverse=True)
    assert 0.9 < math.fsum(probabilities) <= 1.0 + 1e-9
    assert len({one.tree for one in found}) == len(found)


@pytest.mark.parametrize(
    "text",
    [
        "Could you please go to the cone, thanks!",
        "hey husky would you be so kind as to go to the cone",
        "I was wondering if you could go to the cone for me",
        "um, i need you to, uh, go to the cone now",
    ],
)
def test_politeness_changes_nothing(text: str) -> None:
    assert parses(text) == parses("go to the cone")


def test_a_filler_inside_a_longer_expression_is_none() -> None:
    assert "(RB as_fast_as_you_can)" in bracket("go to the cone as fast as you can")


@pytest.mark.parametrize("text", ["cone hydrant the go", "the", "zork of of", "behind behind"])
def test_what_the_grammar_lacks_becomes_fragments(text: str) -> None:
    (found,) = parses(text)
    assert found.partial
    assert found.tree.surface.split() == text.split()


def test_fragments_say_which_words_could_not_be_attached() -> None:
    (found,) = parses("go to the cone the of")
    assert found.partial
    assert found.unattached == ("the", "of")
    assert parses("go to the cone")[0].unattached == ()


def test_words_of_other_robots_are_read_but_mean_nothing() -> None:
    text = "pick up the banana in the kitchen"
    assert bracket(text, "husky") == bracket(text, "husky_ur5")
    assert LEXICA["husky"].senses("NN", "banana") is None
    assert not LEXICA["husky"].known("VB", "pick")
    assert LEXICA["husky_ur5"].known("VB", "pick")


def test_every_robot_knows_names_for_all_its_classes_and_locations() -> None:
    for name, lexicon in LEXICA.items():
        symbols = get_symbols(name)
        meant = {meaning for entry in lexicon.content_words() for meaning in entry.meanings}
        wanted = {*symbols.object_classes, *symbols.locations}
        assert wanted <= {meaning for kind, meaning in meant if kind == "class"}


@given(st.text(max_size=300))
@settings(max_examples=100, deadline=None)
def test_any_text_gets_a_tree_that_holds_its_words(text: str) -> None:
    tokens = LEXICA["husky"].strip_fillers(tokenize(text))
    started = time.perf_counter()
    found = parse(tokens, LEXICA["husky"], GRAMMAR)
    assert time.perf_counter() - started < MAX_PARSE_S
    assert bool(found) == bool(tokens)
    assert math.fsum(one.probability for one in found) <= 1.0 + 1e-9
    for one in found:
        assert parse_bracket(one.tree.bracket()) == one.tree


VOCABULARY = sorted({word for entry in LEXICA["husky_ur5"].entries for word in entry.words})


@given(st.lists(st.sampled_from(VOCABULARY), min_size=1, max_size=25))
@settings(max_examples=60, deadline=None)
def test_any_words_in_any_order_get_a_tree_in_time(words: list[str]) -> None:
    started = time.perf_counter()
    found = parses(" ".join(words), "husky_ur5")
    assert time.perf_counter() - started < MAX_PARSE_S
    for one in found:
        assert parse_bracket(one.tree.bracket()) == one.tree


@pytest.mark.parametrize(
    "text",
    [
        "a" * 10_000,
        "a " * 5_000,
        "go to the cone " * 667,
        "the hydrant " + "that is behind the cone " * 300,
        "go " * 40,
        "qwerty " * 40,
        "left right " * 20,
        "go to the hydrant behind " + "the cone behind " * 11 + "the tree",
        "\x00\x07 走到消防栓 \U0001f692 иди к гидранту اذهب إلى İstanbul",
    ],
    ids=range(9),
)
def test_hostile_text_gets_a_tree_in_time(text: str) -> None:
    started = time.perf_counter()
    assert parses(text)
    assert time.perf_counter() - started < MAX_PARSE_S


@pytest.mark.parametrize("text", ["", " \n", "!!! ... ???", "\U0001f692", "\x00\x1b"])
def test_text_without_words_has_no_tree(text: str) -> None:
    assert parses(text) == ()
