import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from schemas import topics
from schemas.geometry import Pose2, Pose3
from schemas.health import Fault
from schemas.language import Instruction
from schemas.motion import StopLatch
from schemas.perception import Detections
from schemas.sensing import Intrinsics, LaserScan, Odometry, RgbdFrame
from web.robot_view import scan_points, wheel_corner
from web.view_model import ViewModel

_second = 1_000_000_000
_here = Pose2(0.0, 0.0, 0.0)


def odometry(stamp_ns: int, linear: float = 0.0) -> Odometry:
    return Odometry(
        stamp_ns=stamp_ns,
        odom_from_base=Pose2(1.0, 2.0, 0.5),
        linear=linear,
        angular=0.0,
        variance_per_metre=0.0,
        variance_per_radian=0.0,
    )


def frame(stamp_ns: int) -> RgbdFrame:
    return RgbdFrame(
        stamp_ns=stamp_ns,
        color=np.zeros((24, 32, 3), np.uint8),
        depth_mm=np.zeros((24, 32), np.uint16),
        intrinsics=Intrinsics(32, 24, 23.0, 23.0, 16.0, 12.0),
        base_from_camera=Pose3((0.0, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0)),
        odom_from_base=_here,
    )


def detections(stamp_ns: int) -> Detections:
    return Detections(
        stamp_ns=stamp_ns,
        classes=("cone",),
        odom_from_base=_here,
        boxes_px=np.array([[4.0, 4.0, 12.0, 20.0]]),
        probabilities=np.array([[0.9]]),
        scores=np.array([0.9]),
        centers_base=np.zeros((1, 3)),
        covariances=np.zeros((1, 3, 3)),
        extents=np.zeros((1, 3)),
        view_bearings=np.zeros(2),
        view_ranges=np.zeros(2),
        view_near=0.5,
        picture_size=(32, 24),
        inference_ms=1.0,
    )


@pytest.fixture
def view() -> ViewModel:
    return ViewModel(start_ns=_second)


def test_a_robot_never_heard_of_is_not_live(view):
    assert math.isinf(view.age_s(topics.ODOMETRY))
    assert not view.live


def test_a_robot_that_falls_silent_becomes_stale(view):
    view.put(topics.ODOMETRY, odometry(2 * _second))
    view.tick(2 * _second + 300_000_000)
    assert view.live
    view.tick(4 * _second)
    assert not view.live
    assert view.age_s(topics.ODOMETRY) == pytest.approx(2.0)


def test_rate_is_that_of_the_stamps(view):
    for k in range(20):
        view.put(topics.ODOMETRY, odometry(_second + k * 50_000_000))
    assert view.rate_hz(topics.ODOMETRY) == pytest.approx(20.0)


def test_a_repeated_message_is_neither_news_nor_rate(view):
    said = Instruction(stamp_ns=_second, id="a", text="go", source="cli")
    for _ in range(3):
        view.put(topics.INSTRUCTION, said)
    assert [event.text for event in view.events.events] == ["you: go"]
    assert view.rate_hz(topics.INSTRUCTION) == 0.0


def test_stop_is_shown_until_it_is_released(view):
    view.put(topics.STOP, StopLatch(stamp_ns=1, stopped=True, source="cli"))
    assert view.stopped
    view.put(topics.STOP, StopLatch(stamp_ns=2, stopped=False, source="cli"))
    assert not view.stopped
    assert [event.kind for event in view.events.events] == ["stop", "stop"]


def test_the_same_fault_twice_is_one_line_and_another_is_a_second(view):
    for detail in ("x", "x", "y"):
        view.put(topics.FAULT, Fault(stamp_ns=1, node="mapping", what="late", detail=detail))
    assert len(view.events.events) == 2


def test_boxes_are_shown_on_the_frame_they_were_found_in(view):
    frames = [frame(_second + k * 100_000_000) for k in range(4)]
    for one in frames:
        view.put(topics.RGBD, one)
    view.put(topics.DETECTIONS, detections(frames[1].stamp_ns))
    shot = view.picture()
    assert shot.frame is frames[1]
    assert shot.detections is not None


def test_without_fresh_detections_the_newest_frame_is_shown_bare(view):
    view.put(topics.DETECTIONS, detections(_second))
    view.put(topics.RGBD, frame(_second))
    view.put(topics.RGBD, frame(4 * _second))
    shot = view.picture()
    assert shot.frame.stamp_ns == 4 * _second
    assert shot.detections is None


def test_scan_points_end_where_the_beams_ended():
    scan = LaserScan(
        stamp_ns=0,
        angle_min=0.0,
        angle_increment=math.pi / 2,
        range_max=10.0,
        ranges=np.array([2.0, 3.0, np.inf, 10.0], np.float32),
        base_from_laser=Pose2(0.5, 0.0, 0.0),
        odom_from_base=Pose2(1.0, 1.0, math.pi / 2),
    )
    assert_allclose(scan_points(scan, 0.4), [[1.0, 3.5, 0.4], [-2.0, 1.5, 0.4]], atol=1e-6)


@pytest.mark.parametrize(
    ("joint", "corner"),
    [("front_left_wheel", "front_left"), ("rear_right_wheel_joint", "rear_right"), ("pan", "")],
)
def test_wheels_are_found_by_what_their_joints_are_called(joint, corner):
    assert wheel_corner(joint) == corner
