"""The corpus checker says file, line, what is wrong and what is allowed; training learns."""

from pathlib import Path

import numpy as np
import pytest

from robots.catalogue import get_robot
from robots.symbols import get_symbols
from services.grounding.behavior import PAIR_FEATURES
from services.grounding.corpus import CORPORA, read_corpus, read_held_out
from services.grounding.errors import GroundingError
from services.grounding.features import SymbolFeatures
from services.grounding.grammar import Grammar
from services.grounding.hdcg import RuleFeatures
from services.grounding.lexicon import Lexicon
from services.grounding.model import GroundingModel
from services.grounding.symbols import SymbolTable
from services.grounding.training.calibration import expected_calibration_error
from services.grounding.training.fit import fit
from services.grounding.training.rows import build_problem, labelled_phrases
from services.grounding.weights import ModelWeights, load_weights, save_weights

SYMBOLS = get_robot("husky").symbols
TABLE = SymbolTable(SYMBOLS)
LEXICON = Lexicon.load(SYMBOLS)
FEATURES = SymbolFeatures(TABLE, LEXICON)
RULES = RuleFeatures(TABLE, LEXICON)
GOOD = """# one example
go to the cone
    (VP (VB go) (PP (TO to) (NP (DT the) (NN cone))))
    VP go to the cone: navigate(cone)
    PP to the cone: cone
    NP the cone: cone
"""


@pytest.mark.parametrize(("robot", "size"), [("husky", 39), ("wheelchair", 54), ("husky_ur5", 115)])
def test_corpus_has_the_papers_size_and_covers_every_name_twice(robot: str, size: int) -> None:
    table = SymbolTable(get_symbols(robot))
    examples = read_corpus(CORPORA / f"{robot}.txt", table)
    assert len(examples) == len({one.text for one in examples}) == size
    said = [
        {symbol.head for symbol in named} | {name for symbol in named for name in symbol.arguments}
        for one in examples
        for named in [[table.symbols[at] for symbols in one.symbols for at in symbols]]
    ]
    # "behind" and "back" are one word to the arm's robot, and its words mean the first.
    names = {name for kind in table.names.values() for name in kind} - {"unknown"}
    for name in names - ({"back"} if robot == "husky_ur5" else set()):
        assert sum(name in one for one in said) >= 2, name


@pytest.mark.parametrize("robot", ["husky", "wheelchair", "husky_ur5"])
def test_trees_of_the_corpus_are_those_of_the_parser(robot: str) -> None:
    model = GroundingModel.load(robot)
    examples = read_corpus(CORPORA / f"{robot}.txt", model.table)
    same = [model.parses(one.text)[0].tree == one.tree for one in examples]
    assert np.mean(same) > 0.95


@pytest.mark.parametrize("robot", ["husky", "wheelchair", "husky_ur5"])
def test_corpus_is_read_as_it_is_annotated(robot: str) -> None:
    model = GroundingModel.load(robot)
    wrong: list[str] = []
    for one in read_corpus(CORPORA / f"{robot}.txt", model.table):
        readings = model.readings(one.text)
        if max(readings, key=lambda symbols: readings[symbols]) != one.symbols[0]:
            wrong.append(one.text)
    assert len(wrong) <= 2, wrong


def test_good_corpus(tmp_path: Path) -> None:
    path = tmp_path / "good.txt"
    path.write_text(GOOD)
    (example,) = read_corpus(path, TABLE)
    assert [len(symbols) for symbols in example.symbols] == [1, 1, 1]


@pytest.mark.parametrize(
    ("good", "bad", "line", "says"),
    [
        ("navigate(cone)", "navigate(fence)", 4, "allowed"),
        ("navigate(cone)", "fly(cone)", 4, "navigate"),
        ("NP the cone: cone\n", "NP a cone: cone\n", 6, "NP the cone"),
        ("    NP the cone: cone\n", "", 3, "3"),
        ("(NN cone))))", "(NN cone)))", 3, "tree"),
        ("go to the cone\n    (VP", "    go to\n    (VP", 2, "column 1"),
    ],
)
def test_bad_corpus(tmp_path: Path, good: str, bad: str, line: int, says: str) -> None:
    assert good in GOOD
    path = tmp_path / "bad.txt"
    path.write_text(GOOD.replace(good, bad, 1))
    with pytest.raises(GroundingError, match=f"bad.txt:{line}:") as caught:
        read_corpus(path, TABLE)
    assert says in str(caught.value)


def test_bad_held_out_line(tmp_path: Path) -> None:
    path = tmp_path / "bad.txt"
    path.write_text("go to the cone: navigate(cone)\n")
    with pytest.raises(GroundingError, match=r"bad\.txt:1:"):
        read_held_out(path, TABLE)


@pytest.mark.parametrize("line", ["NP -> NP PP", "NP NP PP | 1", "NP -> X | -1", "A -> A | 1"])
def test_bad_grammar(tmp_path: Path, line: str) -> None:
    path = tmp_path / "bad.grammar"
    path.write_text(line + "\n")
    with pytest.raises(GroundingError, match=r"bad\.grammar"):
        Grammar.load(path)


@pytest.mark.parametrize("line", ["cone | NN", "cone | NN | color=red", " | NN | class=cone"])
def test_bad_lexicon(tmp_path: Path, line: str) -> None:
    path = tmp_path / "bad.lexicon"
    path.write_text("# comment\n" + line + "\n")
    with pytest.raises(GroundingError, match=r"bad\.lexicon:2:"):
        Lexicon.load(SYMBOLS, [path])


def test_missing_weights_say_how_to_make_them(tmp_path: Path) -> None:
    with pytest.raises(GroundingError, match="train grounding --robot rover"):
        load_weights(tmp_path / "rover.json", FEATURES, RULES)


def test_weights_learned_without_a_class_pair_compose_it(tmp_path: Path) -> None:
    """Removes every example with a barrel and a tree together, or a hydrant, and still reads them.

    Composition comes from match features, so classes need not have been seen at all.
    """
    examples = read_corpus(CORPORA / "husky.txt", TABLE)
    seen = [e for e in examples if "hydrant" not in e.text]
    problem = build_problem([labelled_phrases(one) for one in seen], FEATURES)
    values = fit(problem, np.ones(len(seen), dtype=np.bool_), 0.01, np.zeros(len(problem.columns)))
    weights = ModelWeights(problem.weights(values), None, np.zeros(len(PAIR_FEATURES)), 1.5)
    save_weights(tmp_path / "w.json", weights, FEATURES, RULES)
    loaded = load_weights(tmp_path / "w.json", FEATURES, RULES)
    assert (loaded.temperature, loaded.rules) == (1.5, None)
    model = GroundingModel(LEXICON, loaded)
    found = model.understand("go to the hydrant behind the barrel").annotations[0]
    assert found.relations == (("back", "hydrant", "barrel"),)


def test_calibration_error() -> None:
    right = np.array([True, True, True, False])
    assert expected_calibration_error(np.full(4, 0.75), right) == pytest.approx(0.0)
    assert expected_calibration_error(np.full(4, 0.95), right) == pytest.approx(0.2)
