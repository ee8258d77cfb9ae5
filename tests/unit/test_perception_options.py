"""--detector and --classes: tried out before anything starts."""

from pathlib import Path

import pytest

from schemas.errors import UserError
from schemas.run import RunConfig
from services import cli
from services.commands.detectors import chosen
from services.perception.detection.detector import default_weights
from services.runtime.provenance import run_metadata


def test_without_options_the_run_names_no_files():
    assert chosen((), ()) == ((), ())


def test_what_a_file_was_taken_for_is_told(capsys: pytest.CaptureFixture[str], monkeypatch):
    monkeypatch.chdir(default_weights.parent)
    weights, names = chosen([Path("detector.onnx")], [])
    assert weights == (str(default_weights.resolve()),)
    assert names == ()
    told = capsys.readouterr().err
    assert "layout" in told
    assert "licence: Apache-2.0" in told


def test_class_files_alone_are_refused():
    with pytest.raises(UserError, match="goes with --detector"):
        chosen([], [Path("names.txt")])


def test_a_file_that_cannot_be_used_ends_the_verb_with_the_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    broken = tmp_path / "broken.onnx"
    broken.write_bytes(b"not a network")
    code = cli.main(["up", "--detector", str(broken)])
    assert code == 2
    assert "not a whole ONNX file" in capsys.readouterr().err


def test_the_log_says_which_network_looked():
    weights = run_metadata(RunConfig(detectors=(str(default_weights),)))["weights"]
    assert len(weights[str(default_weights)]) == 64
