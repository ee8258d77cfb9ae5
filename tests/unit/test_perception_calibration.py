import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from services.perception.detection.calibration import (
    Calibration,
    calibration_error,
    fit,
    reliability,
)


def sigmoid(x: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-x))


def drawn(seed: int, slope: float, offset: float, count: int = 4000):
    """Boxes whose true probabilities are known: scores, class scores, on object, classes."""
    rng = np.random.default_rng(seed)
    logits = rng.normal(0, 2, count)
    class_logits = rng.normal(0, 2, (count, 4))
    spread = np.exp(class_logits / 2.0)
    chances = spread / spread.sum(1, keepdims=True)
    classes = (chances.cumsum(1) < rng.random(count)[:, None]).sum(1).clip(max=3)
    on_object = rng.random(count) < sigmoid(slope * logits + offset)
    return sigmoid(logits), sigmoid(class_logits), on_object, classes.astype(np.int32)


def test_fit_recovers_what_the_data_were_drawn_from():
    found = fit(*drawn(0, slope=1.5, offset=0.7))
    assert found.slope == pytest.approx(1.5, abs=0.2)
    assert found.offset == pytest.approx(0.7, abs=0.2)
    assert found.temperature == pytest.approx(2.0, rel=0.15)


def test_fitted_probabilities_come_true():
    found = fit(*drawn(0, slope=0.6, offset=-0.8))
    scores, class_scores, on_object, classes = drawn(1, slope=0.6, offset=-0.8)
    distribution = found.distribution(scores, class_scores)
    right = on_object & (distribution.argmax(1) == classes)
    assert calibration_error(reliability(distribution.max(1), right)) < 0.03
    raw = scores * class_scores.max(1)
    assert calibration_error(reliability(raw, right)) > 0.05


def test_separable_data_stay_finite():
    scores = np.array([0.1, 0.2, 0.8, 0.9])
    class_scores = np.array([[0.9, 0.1]] * 4)
    found = fit(scores, class_scores, scores > 0.5, np.zeros(4, np.int32))
    assert np.isfinite([found.slope, found.offset, found.temperature]).all()


@settings(deadline=None)
@given(
    seed=st.integers(0, 1000),
    slope=st.floats(0.1, 5),
    offset=st.floats(-3, 3),
    temperature=st.floats(0.2, 5),
)
def test_rows_sum_to_the_object_probability(
    seed: int, slope: float, offset: float, temperature: float
):
    rng = np.random.default_rng(seed)
    scores, class_scores = rng.random(5), rng.random((5, 3))
    calibration = Calibration(slope=slope, offset=offset, temperature=temperature)
    rows = calibration.distribution(scores, class_scores)
    assert (rows >= 0).all()
    np.testing.assert_allclose(rows.sum(1), calibration.object_probabilities(scores))
    assert (rows.sum(1) <= 1).all()
    np.testing.assert_array_equal(rows.argmax(1), class_scores.argmax(1))


def test_no_boxes_have_no_rows():
    assert Calibration().distribution(np.zeros(0), np.zeros((0, 3))).shape == (0, 3)


def test_reliability_counts_every_box_once():
    probabilities = np.array([0.0, 0.05, 0.5, 0.55, 1.0])
    table = reliability(probabilities, np.array([False, False, True, False, True]))
    assert [row.count for row in table] == [2, 2, 1]
    assert [row.frequency for row in table] == [0.0, 0.5, 1.0]
