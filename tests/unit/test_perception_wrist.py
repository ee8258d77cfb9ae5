"""Perception looks through the wrist's camera while the arm is at work, and only then."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from robots.husky.spec import HUSKY
from schemas import topics
from schemas.geometry import Pose2
from schemas.perception import Bodies, Detections
from schemas.run import RunConfig
from schemas.sensing import Intrinsics, RgbdFrame, WristFrame
from schemas.task import HandlingStatus, TaskState
from services.perception.node import PerceptionNode

DATA = Path(__file__).parents[1] / "data"


@pytest.fixture
def node() -> PerceptionNode:
    return PerceptionNode(RunConfig(adaptive=False), np.random.default_rng(0))


@pytest.fixture(scope="module")
def frame() -> WristFrame:
    with np.load(DATA / "perception_frame.npz") as arrays:
        return WristFrame(
            stamp_ns=123,
            color=arrays["color"],
            depth_mm=arrays["depth_mm"],
            intrinsics=Intrinsics(320, 240, *arrays["intrinsics"].tolist()),
            base_from_camera=HUSKY.camera.base_from_camera,
            odom_from_base=Pose2(1.0, 2.0, 0.3),
        )


def arm(node: PerceptionNode, state: TaskState) -> None:
    status = HandlingStatus(
        stamp_ns=1, goal_id="1", state=state, failure=None, reason="", holding=""
    )
    assert not list(node.handlers()[topics.HANDLING_STATUS](status))


def test_it_looks_while_the_arm_is_at_work_and_only_then(node: PerceptionNode, frame: WristFrame):
    look = node.handlers()[topics.WRIST_RGBD]
    assert not list(look(frame))
    arm(node, TaskState.ACTIVE)
    assert [output.topic for output in look(frame)] == [
        topics.WRIST_DETECTIONS,
        topics.WRIST_BODIES,
    ]
    arm(node, TaskState.SUCCEEDED)
    assert not list(look(frame))


def test_it_sees_what_the_other_camera_would_see_and_says_nothing_of_the_ground(
    node: PerceptionNode, frame: WristFrame
):
    arm(node, TaskState.ACTIVE)
    detections, bodies = [one.message for one in node.handlers()[topics.WRIST_RGBD](frame)]
    assert isinstance(detections, Detections)
    assert isinstance(bodies, Bodies)
    same = RgbdFrame(**msgspec.structs.asdict(frame))
    other, _ = [one.message for one in node.handlers()[topics.RGBD](same)]
    assert isinstance(other, Detections)
    assert len(detections.centers_base) > 0
    np.testing.assert_array_equal(detections.centers_base, other.centers_base)
    assert len(bodies.positions_base) == len(detections.centers_base)
    assert len(other.view_ranges) > 0
    assert len(detections.view_ranges) == 0


def test_a_picture_that_cannot_be_is_counted_and_told(node: PerceptionNode, frame: WristFrame):
    arm(node, TaskState.ACTIVE)
    black = msgspec.structs.replace(frame, color=np.zeros_like(frame.color))
    (output,) = node.handlers()[topics.WRIST_RGBD](black)
    assert output.topic is topics.FAULT
    assert "wrist frame dropped" in str(output.message)
