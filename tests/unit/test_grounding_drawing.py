"""Drawings of factor graphs, and what is read off the graph for them."""

from pathlib import Path

import numpy as np
import pytest

from services.cli import main
from services.grounding.drawing import DrawingError, draw
from services.grounding.explanation import read_phrases
from services.grounding.model import GroundingModel
from services.grounding.tree import parse_bracket

MODEL = GroundingModel.load("husky")
TEXT = "go to the hydrant behind the cone"

STRANGE = [
    "",
    "走到消防栓 \U0001f692",
    "$x^2$ \\frac go to the $cone$ ${",
    "\x00\x07 go to the cone",
    "flarb the zork (quickly) & <b>",
    "a" * 5000,
    "the hydrant " + "that is behind the cone " * 300,
]


def drawn(text: str, path: Path) -> bytes:
    understanding = MODEL.understand(text)
    draw(understanding, read_phrases(MODEL, understanding), path)
    return path.read_bytes()


def test_every_phrase_is_read_parents_first() -> None:
    understanding = MODEL.understand(TEXT)
    readings = read_phrases(MODEL, understanding)
    tree = parse_bracket(understanding.parse)
    assert [one.phrase for one in readings] == list(tree.preorder())
    assert readings[0].best == ("back(hydrant, cone)", "navigate(hydrant)")
    assert all(0.0 < p <= 1.0 + 1e-9 for one in readings for _, p in one.symbols)
    for one in readings:
        probabilities = [p for _, p in one.symbols]
        assert probabilities == sorted(probabilities, reverse=True)


def test_phrase_probabilities_agree_with_the_readings_of_the_sentence() -> None:
    understanding = MODEL.understand(TEXT)
    root, *_ = read_phrases(MODEL, understanding)
    assert root.probability == pytest.approx(understanding.annotations[0].probability, abs=0.1)
    assert dict(root.symbols)["navigate(hydrant)"] == pytest.approx(1.0, abs=0.05)


def test_svg_has_words_labels_symbols_and_alternatives(tmp_path: Path) -> None:
    picture = drawn(TEXT, tmp_path / "graph.svg").decode()
    for said in ("hydrant", "NP", "back(hydrant, cone)", "annotations", "behaviors"):
        assert f"<!-- {said}" in picture or said in picture


@pytest.mark.parametrize(
    ("suffix", "magic"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")]
)
def test_the_suffix_says_the_format(suffix: str, magic: bytes, tmp_path: Path) -> None:
    assert drawn(TEXT, tmp_path / "new" / f"graph.{suffix}").startswith(magic)


@pytest.mark.parametrize("text", STRANGE, ids=range(len(STRANGE)))
@pytest.mark.filterwarnings("error")
def test_any_text_is_drawn(text: str, tmp_path: Path) -> None:
    assert drawn(text, tmp_path / "graph.svg")


def test_other_formats_are_named(tmp_path: Path) -> None:
    with pytest.raises(DrawingError, match="png, svg, pdf"):
        drawn(TEXT, tmp_path / "graph.gif")


def test_ground_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "graph.png"
    assert main(["ground", TEXT, "--plot", str(path)]) == 0
    assert path.read_bytes().startswith(b"\x89PNG")
    assert "hydrant" in capsys.readouterr().out


def test_drawing_changes_no_answer() -> None:
    before = MODEL.understand(TEXT)
    first = read_phrases(MODEL, before)
    assert read_phrases(MODEL, before) == first
    assert MODEL.understand(TEXT) == before
    assert np.isfinite([p for one in first for _, p in one.symbols]).all()
