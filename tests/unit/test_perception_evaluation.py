import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from services.perception.detection.boxes import Boxes
from services.perception.training.detector.evaluation import (
    Labelled,
    Ranked,
    class_precisions,
    matches,
    near_only,
    near_side,
    outcomes,
    overlap_matrix,
    ranked,
)
from services.perception.training.detector.threshold import (
    found_per_hundred,
    precision_and_recall,
    working_threshold,
)

BOXES = np.array([[0, 0, 10, 10], [20, 0, 30, 10], [40, 40, 60, 80.0]])


def found(boxes: np.ndarray, classes: list[int], scores: list[float]) -> Boxes:
    rows = np.eye(3)[classes]
    return Boxes(boxes, np.array(scores), rows, rows)


def labelled(
    boxes: Boxes, true_boxes: np.ndarray, classes: np.ndarray, ignored: np.ndarray | None = None
) -> Labelled:
    return Labelled(boxes, true_boxes, classes, np.zeros((0, 4)) if ignored is None else ignored)


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
    picture = labelled(found(BOXES, [0, 1, 2], [0.9, 0.8, 0.7]), BOXES, np.arange(3))
    np.testing.assert_allclose(class_precisions([picture], 3, 0.5), 1.0)


def test_wrong_class_counts_as_miss_and_mistake():
    picture = labelled(found(BOXES, [1, 1, 2], [0.9, 0.8, 0.7]), BOXES, np.arange(3))
    np.testing.assert_allclose(class_precisions([picture], 3, 0.5), [0.0, 0.5, 1.0])


def test_class_that_never_occurs_has_no_precision():
    picture = labelled(found(BOXES[:1], [0], [0.9]), BOXES[:1], np.array([0]))
    assert np.isnan(class_precisions([picture], 3, 0.5)).tolist() == [False, True, True]


def one_class(scores: np.ndarray, correct: np.ndarray, count: int) -> Ranked:
    """Boxes of one class in a picture each, `count` objects in the first."""
    order = np.argsort(-scores)
    positives = np.zeros(len(scores), np.int32)
    positives[0] = count
    return Ranked(order.astype(np.int32), scores[order], correct[order], positives)


def test_known_curve():
    found_of = one_class(np.array([0.9, 0.8, 0.7]), np.array([True, False, True]), 2)
    assert found_of.average_precision() == pytest.approx(5 / 6)
    recall, precision = found_of.curve()
    np.testing.assert_allclose(recall, [1 / 2, 1 / 2, 1])
    np.testing.assert_allclose(precision, [1, 1 / 2, 2 / 3])


@settings(deadline=None)
@given(seed=st.integers(0, 1000), count=st.integers(1, 50))
def test_precision_depends_on_order_alone(seed: int, count: int):
    rng = np.random.default_rng(seed)
    scores, correct = rng.permutation(count) / count, rng.random(count) < 0.5
    value = one_class(scores, correct, count).average_precision()
    assert 0 <= value <= 1
    assert one_class(scores**3, correct, count).average_precision() == pytest.approx(value)


@settings(deadline=None)
@given(seed=st.integers(0, 1000))
def test_a_picture_that_counts_twice_counts_like_two(seed: int):
    rng = np.random.default_rng(seed)
    some = [
        labelled(
            found(
                BOXES + rng.uniform(0, 6, (3, 1)), [0, 0, 1], rng.permutation(3) / 3 + number / 9
            ),
            BOXES,
            np.array([0, 1, 0]),
        )
        for number in range(3)
    ]
    weighted = ranked(some, 0, 0.5).average_precision(np.array([2.0, 0.0, 1.0]))
    again = ranked([some[0], some[0], some[2]], 0, 0.5).average_precision()
    assert weighted == pytest.approx(again)


def test_outcomes_name_what_each_box_is_on():
    picture = labelled(
        found(np.vstack([BOXES[:1], BOXES[:1] + 200]), [1, 0], [0.9, 0.5]), BOXES, np.arange(3)
    )
    empty = labelled(found(np.zeros((0, 4)), [], []), BOXES, np.arange(3))
    result = outcomes([picture, empty])
    assert result.boxes.scores.tolist() == [0.9, 0.5]
    assert result.on_object.tolist() == [True, False]
    assert result.true_classes.tolist() == [0, -1]
    assert result.correct.tolist() == [False, False]


def test_ignored_objects_are_neither_missed_nor_wrongly_found():
    boxes = found(BOXES, [0, 1, 2], [0.9, 0.8, 0.7])
    picture = labelled(boxes, BOXES[:1], np.array([0]), BOXES[1:2])
    assert class_precisions([picture], 3, 0.5)[0] == 1.0
    result = outcomes([picture])
    assert result.boxes.scores.tolist() == [0.9, 0.7]
    assert result.true_classes.tolist() == [0, -1]
    unfound = labelled(found(BOXES[:1], [0], [0.9]), BOXES[:1], np.array([0]), BOXES[1:])
    assert class_precisions([unfound], 1, 0.5).tolist() == [1.0]


def test_an_object_beside_an_ignored_one_still_counts():
    boxes = found(BOXES[:1], [0], [0.9])
    picture = labelled(boxes, BOXES[:1], np.array([0]), BOXES[:1])
    assert class_precisions([picture], 1, 0.5).tolist() == [1.0]


def pictures(scores_right: list[float], scores_wrong: list[float]) -> list[Labelled]:
    """One object a picture, found with the first scores; as many pictures with nothing in them."""
    right = [labelled(found(BOXES[:1], [0], [s]), BOXES[:1], np.array([0])) for s in scores_right]
    nothing = np.zeros((0, 4)), np.zeros(0, int)
    wrong = [labelled(found(BOXES[1:2], [1], [s]), *nothing) for s in scores_wrong]
    return right + wrong


def test_the_threshold_parts_right_from_wrong():
    sample = pictures([0.5 + 0.005 * i for i in range(100)], [0.001 * i for i in range(400)])
    threshold = working_threshold(sample)
    assert 0.399 < threshold <= 0.51
    assert precision_and_recall(sample, threshold) == (1.0, pytest.approx(1.0, abs=0.02))


def test_the_threshold_rises_until_hardly_anything_is_invented():
    sample = pictures([0.9] * 100, [0.6] * 20 + [0.1] * 80)
    threshold = working_threshold(sample)
    assert threshold > 0.6
    assert found_per_hundred(sample[100:], threshold) == 0
    assert found_per_hundred(sample[100:], 0.5) == 20


def test_small_objects_and_boxes_on_them_are_not_asked_for():
    small, large = [0, 0, 10, near_side - 1], [50, 0, 70, near_side + 10]
    around_small = [0, 0, 10, near_side + 1]
    boxes = found(np.array([large, around_small, small]), [0, 1, 2], [0.9, 0.8, 0.7])
    near = near_only(labelled(boxes, np.array([small, large]), np.array([1, 0])))
    assert near.true_classes.tolist() == [0]
    assert outcomes([near]).boxes.corners_px.tolist() == [large]
