"""Words: clitics, inflection, spelling, and the bracket notation of trees."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robots.symbols import get_symbols
from services.grounding.errors import GroundingError
from services.grounding.lexicon import Lexicon
from services.grounding.morphology import gerund, plural, unknown_entries
from services.grounding.spelling import Spelling, is_one_slip
from services.grounding.text import tokenize
from services.grounding.tree import Phrase, Word, parse_bracket


def _in_phrase(word: Word) -> Phrase:
    return Phrase("NP", (word,))


LEXICON = Lexicon.load(get_symbols("husky"))
LETTERS = st.text("abcdef", min_size=5, max_size=9)
NAMES = st.text("abcXYZ'_-1", min_size=1, max_size=6)
TREES = st.recursive(
    st.builds(Word, NAMES, NAMES).map(_in_phrase),
    lambda below: st.builds(Phrase, NAMES, st.lists(below, min_size=1, max_size=3).map(tuple)),
    max_leaves=8,
)


def leaves(text: str) -> list[str]:
    return [entry.text for _, _, entry in LEXICON.lattice(tokenize(text))]


def test_tokens_remember_where_they_stood() -> None:
    text = "Go: you'll see the tree\u2019s left!"
    found = tokenize(text)
    assert [token.text for token in found] == [
        "go",
        "you",
        "'ll",
        "see",
        "the",
        "tree",
        "'s",
        "left",
    ]
    assert [text[token.start] for token in found] == ["G", "y", "'", "s", "t", "t", "\u2019", "l"]


@pytest.mark.parametrize(
    ("noun", "several"), [("cone", "cones"), ("box", "boxes"), ("bus", "buses"), ("key", "keys")]
)
def test_plurals(noun: str, several: str) -> None:
    assert plural(noun) == several


@pytest.mark.parametrize(
    ("verb", "form"),
    [
        ("go", "going"),
        ("move", "moving"),
        ("get", "getting"),
        ("see", "seeing"),
        ("wait", "waiting"),
    ],
)
def test_gerunds(verb: str, form: str) -> None:
    assert gerund(verb) == form


def test_inflected_words_stand_in_the_tree_as_their_base() -> None:
    assert "navigate" in leaves("navigating")
    assert "fire_plug" in leaves("fire plugs")


@pytest.mark.parametrize(
    ("word", "tag"),
    [
        ("gingerly", "RB:unk"),
        ("7", "CD"),
        ("21st", "JJ"),
        ("zorking", "VB:unk"),
        ("zork", "NN:unk"),
    ],
)
def test_unknown_words_are_guessed_by_their_shape(word: str, tag: str) -> None:
    assert tag in [entry.tag for entry in unknown_entries(word)]


@pytest.mark.parametrize("text", ["hydrnat", "hydrantt", "hidrant", "hydrat"])
def test_one_typing_slip_is_read_as_the_word(text: str) -> None:
    assert set(leaves(text)) == {"hydrant"}


def test_a_slip_inside_several_words_is_read_too() -> None:
    lexicon = Lexicon.load(get_symbols("wheelchair"))
    spans = lexicon.lattice(tokenize("confrence room"))
    assert (0, 2, "conference_room") in [(start, end, entry.text) for start, end, entry in spans]


@given(LETTERS, st.lists(LETTERS, max_size=6))
def test_index_finds_exactly_the_words_one_slip_away(word: str, known: list[str]) -> None:
    found = Spelling.of(known).of_word(word)
    near = {other for other in known if is_one_slip(word, other)}
    assert set(found) == ({word} if word in known or not near else near)


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


@given(TREES)
def test_bracket_notation_round_trip(tree: Phrase) -> None:
    assert parse_bracket(tree.bracket()) == tree


@pytest.mark.parametrize("text", ["", "(NP", "(NP)", "(NN cone)", "(NP (NN cone)) x", "NP (NN a)"])
def test_bad_brackets_say_so(text: str) -> None:
    with pytest.raises(GroundingError):
        parse_bracket(text)


def test_entries_of_one_robot_alone_are_left_out_for_others(tmp_path: Path) -> None:
    path = tmp_path / "small.lexicon"
    path.write_text("pick | VB:tr:own | action=pick\nkitchen | NN | class=kitchen\n")
    husky = Lexicon.load(get_symbols("husky"), (path,))
    assert [(entry.text, entry.known) for entry in husky.entries] == [("kitchen", False)]
    handling = Lexicon.load(get_symbols("husky_ur5"), (path,))
    assert [entry.tag for entry in handling.entries if entry.known] == ["VB:tr"]
