import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from services.perception.detection.boxes import (
    Boxes,
    any_overlap,
    class_overlap,
    likely,
    suppressed,
)
from services.perception.detection.calibration import Calibration
from services.perception.detection.card import read_card
from services.perception.detection.decoding import Predictions
from services.perception.detection.detector import Detector, Network, default_weights
from services.perception.detection.picture import network_input, padding_value
from services.perception.errors import DetectorFileError, MissingWeightsError
from services.perception.training.detector.evaluation import overlap_matrix
from services.perception.weight_files import card_path, file_sha256

DATA = Path(__file__).parents[1] / "data"


@pytest.fixture(scope="module")
def detector() -> Detector:
    return Detector()


@pytest.fixture(scope="module")
def color() -> np.ndarray:
    with np.load(DATA / "perception_frame.npz") as arrays:
        return arrays["color"]


def random_boxes(seed: int, count: int, classes: int = 3) -> Boxes:
    rng = np.random.default_rng(seed)
    low = rng.uniform(0, 200, (count, 2))
    corners = np.concatenate([low, low + rng.uniform(10, 80, (count, 2))], axis=1)
    scores = np.sort(rng.uniform(0.3, 1, count))[::-1]
    return boxes_of(corners, scores, rng.uniform(0, 1, (count, classes)))


def boxes_of(corners: np.ndarray, scores: np.ndarray, class_scores: np.ndarray) -> Boxes:
    return Boxes(corners, scores, class_scores, Calibration().distribution(scores, class_scores))


def predictions(*scores: float, classes: int = 1) -> Predictions:
    """Boxes far from one another, each with its score for the first class."""
    corners = np.array([[50.0 * i, 0, 50.0 * i + 9, 9] for i in range(len(scores))])
    class_scores = np.zeros((len(scores), classes))
    class_scores[:, 0] = scores
    return Predictions(corners, np.array(scores), class_scores)


def test_input_keeps_scale_and_pads_below():
    color = np.full((240, 320, 3), 255, np.uint8)
    color[..., 1:] = 0
    blob = network_input(color)
    assert blob.shape == (1, 3, 256, 320)
    assert blob[0, :, 0, 0].tolist() == [1, 0, 0]
    np.testing.assert_allclose(blob[0, :, 240:], padding_value / 255, atol=1e-6)


def test_predictions_below_the_threshold_are_left_out_and_the_rest_sorted():
    found = likely(predictions(0.2, 0.5, 0.9, 0.31), 0.3, Calibration())
    assert found.scores.tolist() == [0.9, 0.5, 0.31]
    assert found.corners_px[:, 0].tolist() == [100, 50, 150]


def test_nothing_found_is_a_result():
    found = suppressed(likely(predictions(0.1), 0.3, Calibration()))
    assert found.corners_px.shape == (0, 4)
    assert found.class_scores.shape == (0, 1)
    assert found.classes.shape == (0,)


@settings(deadline=None)
@given(seed=st.integers(0, 2**31), count=st.integers(1, 30))
def test_survivors_do_not_overlap_and_the_best_stays(seed: int, count: int):
    boxes = random_boxes(seed, count)
    kept = suppressed(boxes)
    overlap = overlap_matrix(kept.corners_px, kept.corners_px) - np.eye(len(kept.scores))
    same = kept.classes[:, None] == kept.classes[None]
    assert (overlap[same] <= class_overlap + 1e-5).all()
    assert (overlap <= any_overlap + 1e-5).all()
    assert kept.scores[0] == boxes.scores[0]
    assert all(a >= b for a, b in pairwise(kept.scores.tolist()))


@settings(deadline=None)
@given(seed=st.integers(0, 2**31), count=st.integers(1, 30))
def test_suppressing_twice_changes_nothing(seed: int, count: int):
    once = suppressed(random_boxes(seed, count))
    twice = suppressed(once)
    np.testing.assert_array_equal(once.corners_px, twice.corners_px)


def test_overlapping_boxes_of_two_classes_both_stay_unless_they_are_one():
    near = np.array([[0, 0, 30, 30], [5, 0, 35, 30.0]])
    same = np.array([[0, 0, 30, 30], [1, 0, 31, 30.0]])
    scores, class_scores = np.array([0.9, 0.8]), np.array([[1.0, 0.0], [0.0, 1.0]])
    assert len(suppressed(boxes_of(near, scores, class_scores)).scores) == 2
    assert len(suppressed(boxes_of(same, scores, class_scores)).scores) == 1


def test_missing_weights_say_how_to_make_them(tmp_path: Path):
    with pytest.raises(MissingWeightsError, match="incognita train detector"):
        read_card(tmp_path / "detector.onnx")


def test_weights_and_card_must_belong_together(tmp_path: Path):
    weights = tmp_path / "detector.onnx"
    weights.write_bytes(default_weights.read_bytes() + b"\0")
    card_path(weights).write_bytes(card_path(default_weights).read_bytes())
    with pytest.raises(MissingWeightsError, match="SHA-256"):
        Detector(weights)


def test_a_file_that_is_no_network_is_refused(tmp_path: Path):
    weights = tmp_path / "detector.onnx"
    weights.write_bytes(b"not a network")
    with pytest.raises(DetectorFileError, match="cannot load"):
        Network(weights)


def test_committed_weights_find_what_they_found(detector: Detector, color: np.ndarray):
    """With new weights, `python -m tests.data.bless_perception` stores what they find."""
    expected = json.loads((DATA / "perception_expected.json").read_text())
    assert expected["sha256"] == file_sha256(default_weights), "weights changed: bless them"
    found = detector.detect(color)
    names = [detector.classes[index] for index in found.classes]
    assert names == expected["names"]
    np.testing.assert_allclose(found.corners_px, expected["boxes_px"], atol=0.05)
    np.testing.assert_allclose(found.scores, expected["scores"], atol=1e-3)


def test_same_picture_same_boxes(detector: Detector, color: np.ndarray):
    first, _, again = (detector.detect(c) for c in (color, color[:, ::-1], color))
    np.testing.assert_array_equal(first.corners_px, again.corners_px)
    np.testing.assert_array_equal(first.class_scores, again.class_scores)


def test_committed_weights_pass_the_gate():
    card = read_card(default_weights)
    assert card.licence == "Apache-2.0"
    assert card.map50 >= 0.85
    assert card.near_average_precision50["cone"] >= 0.95
    assert card.near_average_precision50["hydrant"] >= 0.88
    assert min(card.near_average_precision50.values()) >= 0.79
    assert card.calibration_error < 0.02


def test_agrees_with_onnxruntime(color: np.ndarray):
    runtime = pytest.importorskip("onnxruntime")
    options = runtime.SessionOptions()
    # Its optimiser has been seen to change results.
    options.graph_optimization_level = runtime.GraphOptimizationLevel.ORT_DISABLE_ALL
    session = runtime.InferenceSession(default_weights, options, providers=["CPUExecutionProvider"])
    blob = network_input(color)
    (expected,) = session.run(None, {session.get_inputs()[0].name: blob})
    (ours,) = Network(default_weights)(blob)
    np.testing.assert_allclose(ours, expected, rtol=1e-3, atol=0.01)
