"""Proposals can be read as a corpus, and the checker finds what is wrong with one."""

import io
import json
from pathlib import Path

import pytest

from services.cli import main
from services.grounding.annotate import borrowed_model, check_corpus, propose
from services.grounding.corpus import CORPORA, read_corpus, read_held_out
from services.grounding.model import GroundingModel
from services.grounding.training.evaluation import evaluate

MODEL = GroundingModel.load("husky")
TEXTS = [
    "go to the hydrant behind the cone",
    "#please drive   to the barrel",
    "there is a tree in front of the wall",
    "flarb the zork (twice)",
    "cone wall cone tree",
    "走到消防栓",
]


@pytest.mark.parametrize("text", TEXTS)
def test_a_proposal_is_a_corpus(text: str, tmp_path: Path) -> None:
    path = tmp_path / "new.txt"
    path.write_text(propose(MODEL, text), encoding="utf-8")
    (example,) = read_corpus(path, MODEL.table)
    assert example.text in " ".join(text.split())


def test_a_proposal_is_what_the_model_itself_says(tmp_path: Path) -> None:
    path = tmp_path / "new.txt"
    path.write_text(propose(MODEL, TEXTS[0]), encoding="utf-8")
    (example,) = read_corpus(path, MODEL.table)
    readings = MODEL.readings(TEXTS[0])
    assert example.symbols[0] == max(readings, key=lambda symbols: readings[symbols])


def test_doubts_stand_above_the_sentence() -> None:
    proposal = propose(MODEL, "flarb the zork")
    assert proposal.startswith("# words without a meaning yet: flarb, zork\n")
    assert propose(MODEL, "").startswith("# nothing to annotate")


def test_a_new_robot_borrows_what_another_has_learned(tmp_path: Path) -> None:
    model = borrowed_model("husky_ur5", "husky")
    path = tmp_path / "new.txt"
    path.write_text(propose(model, "drive to the ball behind the suitcase"), encoding="utf-8")
    (example,) = read_corpus(path, model.table)
    assert model.table.parse("behind(ball, suitcase)") in example.symbols[0]


def test_our_corpus_has_nothing_to_mend() -> None:
    found = check_corpus(CORPORA / "husky.txt", "husky")
    assert found.examples == 39
    assert found.phrases > 100
    assert not found.repeated
    assert not found.unused


def test_the_checker_finds_what_teaches_nothing(tmp_path: Path) -> None:
    one = propose(MODEL, "go to the cone")
    other = one.replace("go to the cone\n    (VP", "go to the cone\n    (S").replace(
        "\n    VP", "\n    S"
    )
    path = tmp_path / "corpus.txt"
    path.write_text(f"{one}\n{other}")
    found = check_corpus(path, "husky")
    assert found.examples == 2
    assert found.repeated == ("go to the cone",)
    assert found.other_trees == ("go to the cone",)
    assert "tree" in found.unused["class"]
    assert "cone" not in found.unused["class"]
    assert "navigate" not in found.unused.get("action", ())
    assert found.unused["mode"] == ("safely", "quickly")


def test_check_verb_names_file_line_and_what_is_allowed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bad.txt"
    path.write_text(propose(MODEL, "go to the cone").replace("navigate(cone)", "navigate(kitten)"))
    assert main(["train", "grounding", "--check", str(path)]) == 2
    complaint = capsys.readouterr().err
    assert "bad.txt:3: " in complaint
    assert "allowed names" in complaint
    assert complaint.count("\n") == 1


def test_check_and_annotate_verbs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("go to the cone\n\nthere is a tree\n"))
    assert main(["train", "grounding", "--annotate", "-"]) == 0
    path = tmp_path / "new.txt"
    path.write_text(capsys.readouterr().out)
    assert main(["train", "grounding", "--check", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["examples"] == 2


@pytest.mark.parametrize(
    "arguments",
    [
        ["grounding", "--like", "husky"],
        ["grounding", "--check", "a", "--annotate", "b"],
        ["detector", "--check", "a"],
        ["grounding", "--check", "/nowhere/corpus.txt"],
        ["grounding", "--annotate", "-", "--robot", "toaster"],
    ],
)
def test_wrong_arguments_end_with_one_line(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["train", *arguments]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_evaluation_counts_every_sentence_and_names_confusions(tmp_path: Path) -> None:
    path = tmp_path / "held.txt"
    path.write_text("go to the cone | navigate(cone)\ngo to the tree | navigate(wall)\n")
    found = evaluate(MODEL, read_held_out(path, MODEL.table))
    assert sum(row["sentences"] for row in found["reliability"]) == 2
    assert found["confusion"] == [
        {"role": "object", "right": "wall", "taken_for": "tree", "times": 1}
    ]
