"""Layouts are told apart by shape, and read back into the boxes they were written from."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from services.perception.detection.decoding import Decoder
from services.perception.detection.layouts import (
    Layout,
    Outputs,
    Question,
    Recognised,
    cell_grid,
    recognised,
    strides_of,
)
from services.perception.errors import DetectorFileError

WIDTH, HEIGHT, CLASSES = 128, 96, 3
CELLS = 16 * 12 + 8 * 6 + 4 * 3
STRIDES = (8, 16, 32)
GRID, SIZES = cell_grid(STRIDES, WIDTH, HEIGHT)


def question(**changes: object) -> Question:
    usual = {"width": WIDTH, "height": HEIGHT, "classes": CLASSES}
    return Question(**{**usual, "more_channels": False, "end_to_end": False, **changes})


def rows(count: int = CELLS, classes: int = CLASSES, objectness: bool = True) -> np.ndarray:
    """Boxes about their cells, as decoded networks write them."""
    rng = np.random.default_rng(0)
    each = count // CELLS
    middles = np.tile(GRID, (each, 1)) + rng.uniform(0, 8, (count, 2))
    sides = rng.uniform(4, 60, (count, 2))
    scores = rng.uniform(0, 1, (count, classes + objectness))
    return np.concatenate([middles, sides, scores], axis=1).astype(np.float32)


def read(outputs: Outputs, found: Recognised, classes: int = CLASSES):
    return Decoder(found, classes, WIDTH, HEIGHT)(outputs)


def corners(table: np.ndarray) -> np.ndarray:
    half = table[:, 2:4] / 2
    return np.concatenate([table[:, :2] - half, table[:, :2] + half], axis=1)


@pytest.mark.parametrize("transposed", [True, False])
def test_class_scores_without_objectness(transposed: bool):
    table = rows(objectness=False)
    output = table.T[None] if transposed else table[None]
    found = recognised([output], question())
    assert found == Recognised(Layout.CLASS_SCORES, transposed=transposed)
    result = read([output], found)
    np.testing.assert_allclose(result.corners, corners(table), rtol=1e-5)
    np.testing.assert_allclose(result.class_scores, table[:, 4:])
    np.testing.assert_allclose(result.scores, table[:, 4:].max(axis=1))


def test_masks_and_joints_behind_the_scores_are_left_alone():
    table = np.concatenate([rows(objectness=False), np.full((CELLS, 32), 9.0, np.float32)], axis=1)
    masks = np.zeros((1, 32, 24, 32), np.float32)
    found = recognised([table.T[None], masks], question(more_channels=True))
    assert found.layout is Layout.CLASS_SCORES
    result = read([table.T[None], masks], found)
    assert result.class_scores.shape == (CELLS, CLASSES)
    assert result.scores.max() <= 1


@pytest.mark.parametrize("boxes_a_cell", [1, 3])
def test_decoded_boxes_with_objectness(boxes_a_cell: int):
    table = rows(boxes_a_cell * CELLS)
    found = recognised([table[None]], question())
    assert found == Recognised(Layout.OBJECTNESS, boxes_a_cell)
    result = read([table[None]], found)
    np.testing.assert_allclose(result.corners, corners(table), rtol=1e-5)
    np.testing.assert_allclose(result.scores, table[:, 4] * table[:, 5:].max(axis=1), rtol=1e-6)


def test_two_strides_with_three_boxes_a_cell_are_known():
    count = 3 * (8 * 6 + 4 * 3)
    found = recognised([rows(3 * CELLS)[None, :count]], question())
    assert found == Recognised(Layout.OBJECTNESS, 3)


def offsets(table: np.ndarray) -> np.ndarray:
    """The same boxes, relative to their cells in strides, sizes as logarithms."""
    raw = table.copy()
    raw[:, :2] = (table[:, :2] - GRID) / SIZES
    raw[:, 2:4] = np.log(table[:, 2:4] / SIZES)
    return raw


@pytest.mark.parametrize("logits", [True, False])
def test_boxes_relative_to_their_cells(logits: bool):
    table = rows()
    raw = offsets(table)
    if logits:
        raw[:, 4:] = np.log(table[:, 4:] / (1 - table[:, 4:]))
    found = recognised([raw[None]], question())
    assert found == Recognised(Layout.CELL_OFFSETS, logits=logits)
    result = read([raw[None]], found)
    np.testing.assert_allclose(result.corners, corners(table), atol=1e-3)
    np.testing.assert_allclose(result.class_scores, table[:, 5:], atol=1e-5)


def test_a_map_for_each_stride_in_any_order():
    table, raw = rows(), offsets(rows())
    maps, start = [], 0
    for stride in STRIDES:
        height, width = HEIGHT // stride, WIDTH // stride
        part = raw[start : start + height * width]
        maps.append(part.T.reshape(1, -1, height, width))
        start += height * width
    found = recognised(maps[::-1], question())
    assert found == Recognised(Layout.MAPS)
    np.testing.assert_allclose(read(maps[::-1], found).corners, corners(table), atol=1e-3)


def test_end_to_end_rows_have_one_class_and_empty_ones_are_nothing():
    output = np.zeros((1, 5, 6), np.float32)
    output[0, 0] = [10, 20, 30, 40, 0.9, 2]
    output[0, 1] = [15, 25, 35, 45, 0.4, 0]
    found = recognised([output], question())
    assert found == Recognised(Layout.END_TO_END)
    result = read([output], found)
    assert result.corners.tolist() == [[10, 20, 30, 40], [15, 25, 35, 45]]
    np.testing.assert_allclose(result.class_scores, [[0, 0, 0.9], [0.4, 0, 0]])


def test_end_to_end_without_rows():
    output = np.zeros((1, 0, 6), np.float32)
    assert read([output], recognised([output], question())).corners.shape == (0, 4)


def test_six_columns_of_many_classes_are_end_to_end_whatever_the_number_of_rows():
    output = np.zeros((1, CELLS, 6), np.float32)
    assert recognised([output], question()).layout is Layout.END_TO_END


def test_one_class_with_objectness_is_not_taken_for_end_to_end_unless_the_file_says_so():
    table = rows(3 * CELLS, classes=1)[None]
    assert recognised([table], question(classes=1)).layout is Layout.OBJECTNESS
    assert recognised([table], question(end_to_end=True)).layout is Layout.END_TO_END


def test_a_class_without_a_name_is_refused():
    output = np.zeros((1, 5, 6), np.float32)
    output[0, 0] = [10, 20, 30, 40, 0.9, 7]
    with pytest.raises(DetectorFileError, match="class 7"):
        read([output], Recognised(Layout.END_TO_END))


@pytest.mark.parametrize("flat", [True, False])
def test_corners_as_shares_of_the_picture(flat: bool):
    boxes = np.array([[0, 0.5, 0.25, 1.0]] * 7, np.float32)
    scores = np.linspace(0, 1, 21, dtype=np.float32).reshape(7, 3)
    outputs = [boxes[None] if flat else boxes[None, :, None], scores[None]]
    found = recognised(outputs, question())
    assert found.layout is Layout.CORNERS_AND_SCORES
    result = read(outputs, found)
    np.testing.assert_allclose(result.corners[0], [0, 48, 32, 96])
    np.testing.assert_allclose(result.scores, scores.max(axis=1))


@pytest.mark.parametrize(
    ("outputs", "told"),
    [
        ([rows(classes=4, objectness=False).T[None]], "room for 4"),
        ([rows(classes=5)[None]], "room for 5"),
        ([rows(3 * CELLS, classes=2)[None]], "room for 2"),
        ([np.zeros((1, 5, 1, 4)), np.zeros((1, 5, 9))], "room for 9"),
        ([np.zeros((1, 24, 12, 16)), np.zeros((1, 24, 6, 8))], "anchor boxes"),
        ([np.zeros((1, 1000))], r"\(1, 1000\)"),
        ([np.zeros((1, 300, 9))], r"\(1, 300, 9\)"),
        ([np.zeros((1, 5, 12, 16))], "no known layout"),
        ([], "none"),
    ],
)
def test_what_is_not_understood_is_refused_with_the_shapes(outputs: Outputs, told: str):
    with pytest.raises(DetectorFileError, match=told):
        recognised(outputs, question())


def test_what_a_person_says_decides_where_shapes_leave_a_choice():
    table = rows()[None]
    said = question(said=Layout.CELL_OFFSETS)
    assert recognised([table], said).layout is Layout.CELL_OFFSETS
    with pytest.raises(DetectorFileError, match="said to be"):
        recognised([table], question(said=Layout.MAPS))


@settings(deadline=None)
@given(width=st.integers(1, 20), height=st.integers(1, 20))
def test_strides_are_found_again_from_the_number_of_cells(width: int, height: int):
    cells, sizes = cell_grid(STRIDES, 32 * width, 32 * height)
    assert strides_of(len(cells), 32 * width, 32 * height) == STRIDES
    assert (cells % sizes == 0).all()
    assert (cells < [32 * width, 32 * height]).all()
