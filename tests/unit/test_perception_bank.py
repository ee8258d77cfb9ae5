"""Several detectors work as one."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from services.perception.detection.bank import DetectorBank, user_detectors
from services.perception.detection.boxes import Boxes
from services.perception.detection.detector import Detector, default_weights
from services.perception.detection.gaze import EVERYTHING, Gaze
from services.perception.errors import DetectorFileError

PICTURE = np.zeros((100, 100, 3), np.uint8)
HERE, THERE = [10.0, 10, 30, 30], [60.0, 60, 90, 90]


@dataclass(frozen=True)
class Fixed:
    """Finds the same in every picture."""

    classes: tuple[str, ...]
    boxes: tuple[tuple[list[float], list[float]], ...]
    """Corners, and the probability of each class."""

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        return (self.classes,)

    def looked_at(self, width: int, height: int, gaze: Gaze = EVERYTHING) -> np.ndarray:
        return np.array([[0.0, 0, width, height]])

    def pixels(self, width: int, height: int, gaze: Gaze = EVERYTHING) -> int:
        return width * height

    def detect(self, color: np.ndarray, gaze: Gaze = EVERYTHING) -> Boxes:
        corners = np.array([corners for corners, _ in self.boxes]).reshape(-1, 4)
        rows = np.array([row for _, row in self.boxes]).reshape(-1, len(self.classes))
        return Boxes(corners, rows.max(axis=1, initial=0), rows, rows)


def test_classes_are_merged_by_name_and_boxes_keep_theirs():
    bank = DetectorBank(
        [
            Fixed(("cone", "hydrant"), ((HERE, [0.1, 0.8]),)),
            Fixed(("drill", "cone"), ((THERE, [0.2, 0.6]),)),
        ]
    )
    found = bank.detect(PICTURE)
    assert bank.classes == ("cone", "hydrant", "drill")
    np.testing.assert_allclose(found.probabilities, [[0.1, 0.8, 0], [0.6, 0, 0.2]])
    assert [bank.classes[index] for index in found.classes] == ["hydrant", "cone"]


def test_of_two_detectors_on_one_object_the_surer_one_is_believed():
    sure, unsure = ((HERE, [0.9]),), ((HERE, [0.6]),)
    found = DetectorBank([Fixed(("cone",), unsure), Fixed(("cone",), sure)]).detect(PICTURE)
    np.testing.assert_allclose(found.scores, [0.9])


def test_a_name_that_comes_twice_is_one_class():
    twice = Fixed(("car", "truck", "car"), ((HERE, [0.3, 0.1, 0.4]),))
    bank = DetectorBank([twice])
    found = bank.detect(PICTURE)
    assert bank.classes == ("car", "truck")
    np.testing.assert_allclose(found.probabilities, [[0.7, 0.1]])
    np.testing.assert_allclose(found.scores, [0.7])


def test_nothing_found_by_anyone_is_a_result():
    found = DetectorBank([Fixed(("a",), ()), Fixed(("b",), ())]).detect(PICTURE)
    assert found.corners_px.shape == (0, 4)
    assert found.probabilities.shape == (0, 2)


def test_a_detector_alone_finds_in_a_bank_what_it_finds_outside():
    with np.load(Path(__file__).parents[1] / "data" / "perception_frame.npz") as arrays:
        color = arrays["color"]
    alone = Detector().detect(color)
    (detector,) = user_detectors([str(default_weights)], [])
    found = DetectorBank([detector]).detect(color)
    order = np.argsort(-alone.probabilities.max(axis=1), kind="stable")
    np.testing.assert_allclose(found.corners_px, alone.corners_px[order])
    np.testing.assert_allclose(found.probabilities, alone.probabilities[order])


def test_class_files_must_be_as_many_as_networks():
    with pytest.raises(DetectorFileError, match="2 detectors and 1 class files"):
        user_detectors(["a.onnx", "b.onnx"], ["a.txt"])
