"""The contract of the command line: verbs, exit codes, one-line errors, light start."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from services.cli import VERBS, main

root = Path(__file__).parents[2]
heavy = ("zenoh", "numpy", "sapien", "cv2", "gtsam", "viser", "torch", "tyro", "msgspec", "rich")


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["paint"], 2, ["paint", "ground", "doctor"]),
        (["up", "--world", "mars"], 2, ["mars", "hydrant"]),
        (["up", "--robot", "tank"], 2, ["tank", "husky"]),
        (["up", "--seed", "x"], 2, ["seed"]),
        (["up", "--exit-when-done"], 2, ["--say"]),
        (["demo", "moon"], 2, ["moon", "hydrant"]),
        (["service", "cooking"], 2, ["cooking", "mapping", "robot"]),
        (["watch", "maps"], 2, ["maps", "map/belief"]),
        (["ground", "go", "--robot", "tank"], 2, ["tank", "husky"]),
        (["episode", "--say", "go", "--world", "mars"], 2, ["mars", "hydrant"]),
        (["log", "info", "/nowhere.mcap"], 2, ["/nowhere.mcap"]),
        (["replay", "/nowhere.mcap"], 2, ["/nowhere.mcap"]),
        (["status", "--realm", "nobody-is-here"], 5, ["nobody-is-here", "incognita up"]),
        (["status", "--realm", "../x"], 2, ["realm"]),
        (["say", "go", "--realm", "nobody-is-here"], 5, ["incognita up"]),
    ],
)
def test_errors_are_one_line_that_helps(
    arguments: list[str], code: int, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == code
    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.strip().splitlines()) == 1
    assert said.err.startswith("incognita: ")
    for word in words:
        assert word in said.err


def test_help_names_every_verb_and_imports_nothing_heavy() -> None:
    script = (
        "import sys; from services.cli import main; main(['--help']); "
        f"print([name for name in {heavy!r} if name in sys.modules], file=sys.stderr)"
    )
    ran = subprocess.run(
        [sys.executable, "-c", script], cwd=root, capture_output=True, text=True, check=True
    )
    assert all(f"  {verb} " in ran.stdout for verb in VERBS)
    assert ran.stderr.strip() == "[]"


@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb != "test"])
def test_every_verb_explains_itself_with_an_example(
    verb: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main([verb, "--help"])
    assert ended.value.code == 0
    assert f"incognita {VERBS[verb].example.split()[0]}" in capsys.readouterr().out


def ground(text: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, Any]]:
    code = main(["ground", text, "--robot", "husky", "--json"])
    return code, json.loads(capsys.readouterr().out)


def test_ground_prints_the_document_of_the_contract(capsys: pytest.CaptureFixture[str]) -> None:
    code, answer = ground("go to the hydrant behind the cone", capsys)
    assert code == 0
    assert set(answer) == {
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
    }
    best = answer["behaviors"][0]
    assert {key: best[key] for key in ("action", "object", "mode", "relation", "landmark")} == {
        "action": "navigate",
        "object": "hydrant",
        "mode": "unknown",
        "relation": "back",
        "landmark": "cone",
    }
    relation = {"relation": "back", "figure": "hydrant", "landmark": "cone"}
    assert answer["annotations"][0]["relations"] == [relation]


def test_what_is_not_understood_ends_with_its_own_code(
    capsys: pytest.CaptureFixture[str],
) -> None:
    code, answer = ground("paint the fence", capsys)
    assert code == 3
    assert answer["understood"] is False
    assert answer["unknown_words"] == ["paint", "fence"]


def test_tables_are_json_when_asked(capsys: pytest.CaptureFixture[str]) -> None:
    for verb in ("topics", "robots", "worlds"):
        assert main([verb, "--json"]) == 0
        assert isinstance(json.loads(capsys.readouterr().out), list)


def test_the_graph_shows_every_process(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["graph"]) == 0
    drawn = capsys.readouterr().out
    assert drawn.startswith("graph LR")
    assert "perception -->|detections<br/>scene<br/>wrist/detections| mapping" in drawn
