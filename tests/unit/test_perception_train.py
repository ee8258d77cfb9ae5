# ruff: noqa: E402
"""The whole of `train detector` on a handful of drawn pictures."""

from pathlib import Path

import msgspec
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("onnx")

from services.perception.detection.card import read_card
from services.perception.detection.detector import Detector
from services.perception.errors import MissingFramesError
from services.perception.training.detector.report import TrainingReport
from services.perception.training.detector.train import Recipe, train_detector
from tests.unit.test_perception_frames import (
    empty_frame,
    half_ignored,
    striped_frame,
    write_data,
)

RECIPE = Recipe(classes=("red", "blue"), data="drawn in a test")


def write_sets(folder: Path) -> None:
    frames = [striped_frame(seed) for seed in range(4)]
    write_data(folder / "train", [*frames, half_ignored(frames[0])])
    write_data(folder / "val", frames[:2])
    write_data(folder / "test", [*frames[2:], half_ignored(frames[2])])
    write_data(folder / "empty", [empty_frame()])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_weights_card_and_report_belong_together(tmp_path: Path):
    write_sets(tmp_path / "data")
    out = tmp_path / "weights"
    told = train_detector(tmp_path / "data", out, epochs=7, progress=False, recipe=RECIPE)
    card = read_card(out / "detector.onnx")
    assert msgspec.to_builtins(card) == told
    assert card.classes == RECIPE.classes
    assert card.pictures_seen >= 35
    assert (card.validation_frames, card.test_frames, card.empty_frames) == (2, 3, 1)
    report = msgspec.json.decode((out / "detector_report.json").read_bytes(), type=TrainingReport)
    assert report.card == card
    assert report.data["train"].objects == {"red": 5, "blue": 4}
    assert report.data["train"].ignored == 1
    assert report.data["train"].made == {"seed": "7"}
    assert (out / "detector_reliability.png").read_bytes().startswith(b"\x89PNG")
    found = Detector(out / "detector.onnx").detect(striped_frame().color)
    assert found.class_scores.shape[1] == 2


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_second_call_goes_on_from_the_first(tmp_path: Path):
    write_sets(tmp_path / "data")
    for epochs, seen in ((4, 32), (7, 48)):
        told = train_detector(
            tmp_path / "data", tmp_path, epochs=epochs, progress=False, recipe=RECIPE
        )
        assert told["pictures_seen"] == seen


def test_sets_that_are_missing_are_named(tmp_path: Path):
    write_data(tmp_path / "train", [striped_frame()])
    with pytest.raises(MissingFramesError, match="val"):
        train_detector(tmp_path, tmp_path, progress=False, recipe=RECIPE)
