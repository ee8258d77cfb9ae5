from pathlib import Path

import cv2
import numpy as np
import pytest

from services.perception.errors import PerceptionError
from services.perception.training.frames import Frame, augmented, batches, read_frames


def striped_frame(seed: int = 0) -> Frame:
    """Two rectangles of known colours on grey."""
    rng = np.random.default_rng(seed)
    color = np.full((240, 320, 3), 90, np.uint8)
    boxes = np.array([[60, 60, 120, 160], [180, 80, 260, 140]]) + rng.integers(-20, 20, (2, 1))
    for (x0, y0, x1, y1), paint in zip(boxes, [(230, 30, 30), (30, 30, 230)], strict=True):
        color[y0:y1, x0:x1] = paint
    return Frame(color, boxes.astype(np.float32), np.arange(2))


def write_data(folder: Path, frames: list[Frame]) -> None:
    (folder / "frames").mkdir(parents=True)
    (folder / "shards").mkdir()
    for index, frame in enumerate(frames):
        cv2.imwrite(str(folder / "frames" / f"{index:06d}.jpg"), frame.color[..., ::-1])
    np.savez(
        folder / "shards" / "000000.npz",
        count=np.array([len(frame.classes) for frame in frames]),
        boxes=np.concatenate([frame.boxes for frame in frames]),
        classes=np.concatenate([frame.classes for frame in frames]),
    )


def test_frames_come_back_from_disk(tmp_path: Path):
    empty = Frame(np.zeros((240, 320, 3), np.uint8), np.zeros((0, 4), np.float32), np.zeros(0, int))
    frames = [striped_frame(0), empty, striped_frame(1)]
    write_data(tmp_path, frames)
    for frame, again in zip(frames, read_frames(tmp_path), strict=True):
        np.testing.assert_array_equal(frame.boxes, again.boxes)
        np.testing.assert_array_equal(frame.classes, again.classes)
        assert np.abs(frame.color.astype(int) - again.color).mean() < 3


def test_missing_pictures_are_named(tmp_path: Path):
    with pytest.raises(PerceptionError, match=str(tmp_path)):
        read_frames(tmp_path)


@pytest.mark.parametrize("seed", range(20))
def test_boxes_move_with_the_picture(seed: int):
    frame = augmented(striped_frame(), np.random.default_rng(seed))
    for (x0, y0, x1, y1), channel in zip(frame.boxes, np.array([0, 2])[frame.classes], strict=True):
        inner = frame.color[int(y0) + 4 : int(y1) - 4, int(x0) + 4 : int(x1) - 4].astype(int)
        assert (inner[..., channel] > inner[..., 2 - channel] + 60).all()
        assert x0 >= 0
        assert y0 >= 0
        assert x1 <= 320
        assert y1 <= 240


def test_every_frame_comes_once_before_any_comes_again():
    color, box = np.zeros((240, 320, 3), np.uint8), np.array([[100, 80, 220, 160]], np.float32)
    frames = [Frame(color, box, np.array([index])) for index in range(6)]
    stream = batches(frames, 3, np.random.default_rng(0))
    seen = [int(frame.classes[0]) for _ in range(2) for frame in next(stream)]
    assert sorted(seen) == list(range(6))
