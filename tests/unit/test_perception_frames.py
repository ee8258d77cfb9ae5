from pathlib import Path

import cv2
import numpy as np
import pytest

from services.perception.errors import MissingFramesError
from services.perception.training.detector.augmentation import augmented, mirrored, shuffled
from services.perception.training.detector.frames import Frame, read_frames


def striped_frame(seed: int = 0) -> Frame:
    """Two rectangles of known colours on grey."""
    rng = np.random.default_rng(seed)
    color = np.full((240, 320, 3), 90, np.uint8)
    boxes = np.array([[60, 60, 120, 160], [180, 80, 260, 140]]) + rng.integers(-20, 20, (2, 1))
    for (x0, y0, x1, y1), paint in zip(boxes, [(230, 30, 30), (30, 30, 230)], strict=True):
        color[y0:y1, x0:x1] = paint
    return Frame(color, boxes.astype(np.float32), np.arange(2), np.zeros(2, bool))


def write_data(folder: Path, frames: list[Frame], *, with_ignored: bool = True) -> None:
    (folder / "frames").mkdir(parents=True)
    (folder / "shards").mkdir()
    for index, frame in enumerate(frames):
        cv2.imwrite(str(folder / "frames" / f"{index:06d}.jpg"), frame.color[..., ::-1])
    columns = {
        name: np.concatenate([getattr(frame, name) for frame in frames])
        for name in ("boxes", "classes", "ignored")
    }
    if not with_ignored:
        del columns["ignored"]
    np.savez(
        folder / "shards" / "000000.npz",
        count=np.array([len(frame.classes) for frame in frames]),
        seed=7,
        **columns,
    )


def empty_frame() -> Frame:
    """Nothing on black."""
    return Frame(
        np.zeros((240, 320, 3), np.uint8),
        np.zeros((0, 4), np.float32),
        np.zeros(0, int),
        np.zeros(0, bool),
    )


def half_ignored(frame: Frame) -> Frame:
    return Frame(frame.color, frame.boxes, frame.classes, np.arange(len(frame.classes)) % 2 == 1)


def test_frames_come_back_from_disk(tmp_path: Path):
    frames = [half_ignored(striped_frame(0)), empty_frame(), striped_frame(1)]
    write_data(tmp_path, frames)
    for frame, again in zip(frames, read_frames(tmp_path), strict=True):
        np.testing.assert_array_equal(frame.boxes, again.boxes)
        np.testing.assert_array_equal(frame.classes, again.classes)
        np.testing.assert_array_equal(frame.ignored, again.ignored)
        assert np.abs(frame.color.astype(int) - again.color).mean() < 3


def test_data_that_says_nothing_of_ignored_objects_has_none(tmp_path: Path):
    write_data(tmp_path, [half_ignored(striped_frame(0))], with_ignored=False)
    (frame,) = read_frames(tmp_path)
    assert not frame.ignored.any()


def test_missing_pictures_are_named(tmp_path: Path):
    with pytest.raises(MissingFramesError, match=str(tmp_path)):
        read_frames(tmp_path)


@pytest.mark.parametrize("seed", range(20))
def test_boxes_move_with_the_picture(seed: int):
    frame = augmented(striped_frame(), np.random.default_rng(seed))
    assert_painted(frame)


def assert_painted(frame: Frame) -> None:
    """Each box is full of its object's colour, to within a few pixels of its sides."""
    # Single pixels may be noise, which was added on purpose.
    color = cv2.blur(frame.color, (5, 5))
    for (x0, y0, x1, y1), channel in zip(frame.boxes, np.array([0, 2])[frame.classes], strict=True):
        inner = color[int(y0) + 4 : int(y1) - 4, int(x0) + 4 : int(x1) - 4].astype(int)
        assert (inner[..., channel] > inner[..., 2 - channel] + 60).all()
        assert x0 >= 0
        assert y0 >= 0
        assert x1 <= 320
        assert y1 <= 240


def test_the_mirror_image_fits_its_boxes_to_the_pixel():
    """Half a pixel off in every label costs more than any other choice in training gains."""
    frame, rng = striped_frame(), np.random.default_rng(0)
    pictures = [mirrored(frame, rng) for _ in range(20)]
    assert {bool((picture.color == frame.color).all()) for picture in pictures} == {True, False}
    for picture in pictures:
        assert_to_the_pixel(picture)


def assert_to_the_pixel(frame: Frame) -> None:
    for (x0, y0, x1, y1), channel in zip(frame.boxes, np.array([0, 2])[frame.classes], strict=True):
        painted = frame.color[..., channel].astype(int) > frame.color[..., 2 - channel] + 60
        rows, columns = np.flatnonzero(painted.any(1)), np.flatnonzero(painted.any(0))
        found = [columns[0], rows[0], columns[-1] + 1, rows[-1] + 1]
        assert np.abs(np.array(found) - [x0, y0, x1, y1]).max() < 0.01


def test_enlarged_pictures_fit_their_boxes_to_a_pixel():
    """Bright edges of a plain block: the middle of the blur is where the box says."""
    color = np.zeros((240, 320, 3), np.uint8)
    color[100:140, 120:200] = 200
    box = np.array([[120, 100, 200, 140]], np.float32)
    frame = Frame(color, box, np.array([0]), np.array([False]))
    for seed in range(10):
        moved = augmented(frame, np.random.default_rng(seed))
        x0, y0, x1, y1 = moved.boxes[0]
        if x0 < 3 or y0 < 3 or x1 > 317 or y1 > 237:
            continue
        level = moved.color.astype(float).mean(axis=2)
        inside = level[int(y0) + 3 : int(y1) - 3, int(x0) + 3 : int(x1) - 3].mean()
        row = level[int((y0 + y1) / 2), int(x0) - 3 : int(x0) + 4]
        outside = level[int((y0 + y1) / 2), int(x0) - 3]
        edge = int(x0) + 4 - ((row - outside) / (inside - outside)).sum()
        assert edge == pytest.approx(x0, abs=0.4)


def test_what_a_move_cuts_off_is_ignored_and_what_is_gone_is_gone():
    color = np.full((240, 320, 3), 90, np.uint8)
    boxes = np.array([[0, 0, 12, 200], [150, 100, 170, 140]], np.float32)
    frame = Frame(color, boxes, np.arange(2), np.zeros(2, bool))
    moved = [augmented(frame, np.random.default_rng(seed)) for seed in range(60)]
    at_the_edge = [one.ignored[one.classes == 0] for one in moved]
    assert {len(ignored) for ignored in at_the_edge} == {0, 1}
    assert {bool(ignored[0]) for ignored in at_the_edge if len(ignored)} == {True, False}
    assert not any(one.ignored[one.classes == 1].any() for one in moved)
    assert all((one.boxes[:, 2:] > one.boxes[:, :2]).all() for one in moved)


def test_every_frame_comes_once_before_any_comes_again():
    color, box = np.zeros((240, 320, 3), np.uint8), np.array([[100, 80, 220, 160]], np.float32)
    frames = [Frame(color, box, np.array([index]), np.zeros(1, bool)) for index in range(6)]
    stream = shuffled(frames, 3, np.random.default_rng(0))
    seen = [int(frame.classes[0]) for _ in range(2) for frame in next(stream)]
    assert sorted(seen) == list(range(6))
