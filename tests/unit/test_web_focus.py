"""The camera picture says what of it was looked at, and why the rest was not."""

import msgspec
import numpy as np
import pytest

from schemas import topics
from schemas.perception import Focus
from tests.unit.test_web_view_model import detections, frame
from web.camera_view import annotated
from web.focus_words import focus_html, line_over
from web.view_model import Shot, ViewModel

_second = 1_000_000_000
_FRAME_NS = 200_000_000


def focus(stamp_ns: int, seen_ns: int | None = None, **changes: object) -> Focus:
    told = Focus(
        stamp_ns=stamp_ns,
        wanted=("cone", "hydrant"),
        seen_ns=stamp_ns if seen_ns is None else seen_ns,
        reason="" if seen_ns is None else "same view as 0.4 s ago",
        unsought=(),
        regions_px=np.array([[0, 0, 16, 24]], np.int32),
        passed_px=np.zeros((0, 4), np.int32),
        work=0.25,
        saved=0.6,
    )
    return msgspec.structs.replace(told, **changes)


def bright(stamp_ns: int):
    grey = np.full((24, 32, 3), 200, np.uint8)
    return msgspec.structs.replace(frame(stamp_ns), color=grey)


def test_what_was_not_looked_at_is_dark():
    picture = annotated(Shot(bright(1), None, focus(1)))
    assert (picture[:, :300] == 200).all()
    assert (picture[:, 340:] < 100).all()


def test_without_attention_the_whole_picture_is_as_bright_as_it_was():
    assert (annotated(Shot(bright(1), None, None)) == 200).all()


def test_a_skipped_frame_says_why_and_one_that_was_looked_at_says_nothing():
    assert line_over(focus(5, 1)) == "frame skipped: same view as 0.4 s ago"
    assert line_over(focus(5)) == ""
    looked, skipped = (annotated(Shot(bright(5), None, f)) for f in (focus(5), focus(5, 1)))
    assert (looked[-10:, :150] == 200).all()
    assert skipped[-20:, :150].min() == 0


def test_things_that_were_passed_over_are_framed():
    passed = np.array([[20, 10, 28, 20]], np.int32)
    plain, framed = (
        annotated(Shot(bright(5), None, focus(5, passed_px=boxes)))
        for boxes in (passed[:0], passed)
    )
    changed = np.abs(plain.astype(int) - framed.astype(int)).max(axis=2) > 0
    rows, columns = np.nonzero(changed)
    assert columns.min() >= 395
    assert rows.max() <= 405


def test_words_name_what_is_wanted_and_what_was_left_out():
    told = focus_html(focus(5, unsought=("drill",), passed_px=np.zeros((2, 4), np.int32)))
    assert "Looking for cone, hydrant" in told
    assert "Not looked for in this picture: drill" in told
    assert "Passed over 2 things" in told
    assert "60 % of the networks&#x27; work saved" in told
    assert focus_html(None) == ""
    assert "Nothing to look for" in focus_html(focus(5, wanted=()))


@pytest.fixture
def view() -> ViewModel:
    return ViewModel(start_ns=_second)


def test_boxes_hold_for_a_skipped_frame(view: ViewModel):
    frames = [frame(_second + k * _FRAME_NS) for k in range(3)]
    for one in frames:
        view.put(topics.RGBD, one)
    view.put(topics.DETECTIONS, detections(frames[0].stamp_ns))
    view.put(topics.FOCUS, focus(frames[2].stamp_ns, frames[0].stamp_ns))
    shot = view.picture()
    assert shot is not None
    assert shot.frame is frames[2]
    assert shot.detections is not None
    assert shot.detections.stamp_ns == frames[0].stamp_ns
    assert shot.focus is not None


def test_newer_detections_do_not_replace_those_that_the_focus_speaks_of(view: ViewModel):
    for k in range(2):
        view.put(topics.RGBD, frame(_second + k * _FRAME_NS))
        view.put(topics.DETECTIONS, detections(_second + k * _FRAME_NS))
    view.put(topics.FOCUS, focus(_second))
    shot = view.picture()
    assert shot is not None
    assert shot.detections is not None
    assert shot.frame.stamp_ns == shot.detections.stamp_ns == _second


def test_a_focus_that_fell_behind_is_not_shown(view: ViewModel):
    view.put(topics.RGBD, frame(_second))
    view.put(topics.DETECTIONS, detections(_second))
    view.put(topics.FOCUS, focus(_second))
    view.put(topics.RGBD, frame(4 * _second))
    shot = view.picture()
    assert shot is not None
    assert (shot.frame.stamp_ns, shot.detections, shot.focus) == (4 * _second, None, None)
