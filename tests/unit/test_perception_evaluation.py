import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.perception.boxes import Boxes
from services.perception.training.evaluation import (
    Labelled,
    average_precision,
    class_precisions,
    matches,
    near_only,
    near_side,
    outcomes,
    overlap_matrix,
)

BOXES = np.array([[0, 0, 10, 10], [20, 0, 30, 10], [40, 40, 60, 80.0]])


def found(boxes: np.ndarray, classes: list[int], scores: list[float]) -> Boxes:
    rows = np.eye(3)[classes]
    return Boxes(boxes, np.array(scores), rows, rows)


def test_overlap_is_one_with_itself_and_symmetric():
    overlap = overlap_matrix(BOXES, BOXES)
    np.testing.assert_allclose(overlap, np.eye(3), atol=1e-9)
    shifted = BOXES + 3
    np.testing.assert_allclose(overlap_matrix(BOXES, shifted), overlap_matrix(shifted, BOXES).T)


def test_half_shifted_box_overlaps_by_a_third():
    a, b = np.array([[0, 0, 2, 1.0]]), np.array([[1, 0, 3, 1.0]])
    assert overlap_matrix(a, b)[0, 0] == pytest.approx(1 / 3)


def test_second_box_on_an_object_is_a_mistake():
    twice = np.concatenate([BOXES[:1], BOXES[:1]])
    assert matches(twice, BOXES, 0.5).tolist() == [0, -1]


def test_perfect_detections_have_perfect_precision():
    picture = Labelled(found(BOXES, [0, 1, 2], [0.9, 0.8, 0.7]), BOXES, np.arange(3))
    np.testing.assert_allclose(class_precisions([picture], 3, 0.5), 1.0)


def test_wrong_class_counts_as_miss_and_mistake():
    picture = Labelled(found(BOXES, [1, 1, 2], [0.9, 0.8, 0.7]), BOXES, np.arange(3))
    np.testing.assert_allclose(class_precisions([picture], 3, 0.5), [0.0, 0.5, 1.0])


def test_class_that_never_occurs_has_no_precision():
    picture = Labelled(found(BOXES[:1], [0], [0.9]), BOXES[:1], np.array([0]))
    assert np.isnan(class_precisions([picture], 3, 0.5)).tolist() == [False, True, True]


def test_known_curve():
    correct = np.array([True, False, True])
    assert average_precision(np.array([0.9, 0.8, 0.7]), correct, 2) == pytest.approx(5 / 6)


@given(seed=st.integers(0, 1000), count=st.integers(1, 50))
def test_precision_depends_on_order_alone(seed: int, count: int):
    rng = np.random.default_rng(seed)
    scores, correct = rng.permutation(count) / count, rng.random(count) < 0.5
    value = average_precision(scores, correct, count)
    assert 0 <= value <= 1
    assert average_precision(scores**3, correct, count) == pytest.approx(value)


def test_outcomes_name_what_each_box_is_on():
    picture = Labelled(
        found(np.vstack([BOXES[:1], BOXES[:1] + 200]), [1, 0], [0.9, 0.5]), BOXES, np.arange(3)
    )
    empty = Labelled(found(np.zeros((0, 4)), [], []), BOXES, np.arange(3))
    scores, _, on_object, classes = outcomes([picture, empty])
    assert scores.tolist() == [0.9, 0.5]
    assert on_object.tolist() == [True, False]
    assert classes.tolist() == [0, -1]


def test_small_objects_and_boxes_on_them_are_not_asked_for():
    small, large = [0, 0, 10, near_side - 1], [50, 0, 70, near_side + 10]
    around_small = [0, 0, 10, near_side + 1]
    boxes = found(np.array([large, around_small, small]), [0, 1, 2], [0.9, 0.8, 0.7])
    near = near_only(Labelled(boxes, np.array([small, large]), np.array([1, 0])))
    assert near.true_classes.tolist() == [0]
    assert near.found.corners_px.tolist() == [large]
