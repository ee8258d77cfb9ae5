from pathlib import Path

import numpy as np
import pytest

from robots.husky.spec import HUSKY
from schemas import topics
from schemas.codec import decode, encode
from schemas.geometry import Pose2
from schemas.perception import SOLID_KINDS, Bodies, Detections
from schemas.run import RunConfig
from schemas.sensing import Intrinsics, RgbdFrame
from services.perception.node import PerceptionNode

DATA = Path(__file__).parents[1] / "data"


@pytest.fixture(scope="module")
def node() -> PerceptionNode:
    return PerceptionNode(RunConfig(adaptive=False), np.random.default_rng(0))


@pytest.fixture(scope="module")
def frame() -> RgbdFrame:
    with np.load(DATA / "perception_frame.npz") as arrays:
        return RgbdFrame(
            stamp_ns=123,
            color=arrays["color"],
            depth_mm=arrays["depth_mm"],
            intrinsics=Intrinsics(320, 240, *arrays["intrinsics"].tolist()),
            base_from_camera=HUSKY.camera.base_from_camera,
            odom_from_base=Pose2(1.0, 2.0, 0.3),
        )


@pytest.fixture(scope="module")
def truth() -> list[tuple[str, np.ndarray]]:
    with np.load(DATA / "perception_frame.npz") as arrays:
        return list(zip(arrays["names"].tolist(), arrays["centers_base"], strict=True))


def detections_of(node: PerceptionNode, frame: RgbdFrame) -> Detections:
    output, _ = node.handlers()[topics.RGBD](frame)
    assert output.topic is topics.DETECTIONS
    assert isinstance(output.message, Detections)
    return output.message


def bodies_of(node: PerceptionNode, frame: RgbdFrame) -> Bodies:
    _, output = node.handlers()[topics.RGBD](frame)
    assert output.topic is topics.BODIES
    assert isinstance(output.message, Bodies)
    return output.message


def test_message_survives_the_wire(node: PerceptionNode, frame: RgbdFrame):
    sent = detections_of(node, frame)
    received = decode(encode(sent), Detections)
    assert encode(received) == encode(sent)
    assert received.stamp_ns == frame.stamp_ns
    assert received.odom_from_base == frame.odom_from_base
    assert received.picture_size == (320, 240)


def test_frames_that_came_over_the_wire_give_the_same_message(
    node: PerceptionNode, frame: RgbdFrame
):
    received = decode(encode(frame), RgbdFrame)
    assert encode(detections_of(node, received)) == encode(detections_of(node, frame))


def test_objects_are_where_they_are(node: PerceptionNode, frame: RgbdFrame, truth):
    found = detections_of(node, frame)
    for name, center in truth:
        distances = np.linalg.norm(found.centers_base[:, :2] - center[:2], axis=1)
        index = int(distances.argmin())
        assert distances[index] < 0.2, name
        assert found.classes[int(found.probabilities[index].argmax())] == name
        assert found.probabilities[index].max() > 0.6


def test_bodies_are_the_detections_row_for_row(node: PerceptionNode, frame: RgbdFrame):
    found, bodies = detections_of(node, frame), bodies_of(node, frame)
    received = decode(encode(bodies), Bodies)
    assert encode(received) == encode(bodies)
    assert len(found.scores) > 0
    np.testing.assert_array_equal(bodies.positions_base, found.centers_base)
    np.testing.assert_array_equal(bodies.covariances[:, :3, :3], found.covariances)
    assert (np.linalg.eigvalsh(bodies.covariances) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(bodies.wxyz_base, axis=1), 1.0)
    assert (bodies.sizes[:, 0] >= bodies.sizes[:, 1]).all()
    assert set(bodies.solid_rows.tolist()) == set(range(len(found.scores)))
    assert bodies.solid_kinds.max() < len(SOLID_KINDS)


def test_rows_are_distributions_and_the_clock_is_not_read(node: PerceptionNode, frame: RgbdFrame):
    found = detections_of(node, frame)
    assert (found.probabilities.sum(axis=1) <= 1).all()
    assert found.inference_ms == 0.0
    assert (found.view_ranges <= HUSKY.camera.range_max).all()


def test_an_empty_place_gives_an_empty_message(node: PerceptionNode, frame: RgbdFrame):
    grey = np.full((240, 320, 3), 114, np.uint8)
    blank = RgbdFrame(
        stamp_ns=1,
        color=grey,
        depth_mm=np.zeros((240, 320), np.uint16),
        intrinsics=frame.intrinsics,
        base_from_camera=frame.base_from_camera,
        odom_from_base=frame.odom_from_base,
    )
    found = detections_of(node, blank)
    assert found.centers_base.shape == (0, 3)
    assert found.covariances.shape == (0, 3, 3)
    assert decode(encode(found), Detections).boxes_px.shape == (0, 4)
