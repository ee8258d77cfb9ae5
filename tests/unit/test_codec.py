"""Laws of the codec: identity, no copy, and errors instead of nonsense."""

import contextlib
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from schemas.codec import MalformedMessageError, decode, encode, pack_array, unpack_array
from schemas.geometry import Pose2, Pose3
from schemas.health import Tick
from schemas.sensing import JointState, LaserScan
from schemas.topics import ALL_TOPICS, UnknownTopicError, topic_named

angles = st.floats(-10, 10)
poses = st.builds(Pose2, st.floats(-50, 50), st.floats(-50, 50), angles)


def scan(ranges: np.ndarray) -> LaserScan:
    return LaserScan(
        stamp_ns=5,
        angle_min=-math.pi,
        angle_increment=0.1,
        range_max=20.0,
        ranges=ranges,
        base_from_laser=Pose2(0.3, 0.0, 0.0),
        odom_from_base=Pose2(1.0, 2.0, 3.0),
    )


@given(hnp.arrays(np.float32, hnp.array_shapes(max_dims=1)))
def test_decoding_what_was_encoded_gives_the_same_message(ranges: np.ndarray) -> None:
    sent = scan(ranges)
    received = decode(encode(sent), LaserScan)
    np.testing.assert_array_equal(received.ranges, ranges)
    assert received.odom_from_base == sent.odom_from_base


@pytest.mark.parametrize("dtype", ["f8", "f4", "i8", "i4", "u2", "u1", "i1", "?"])
def test_arrays_of_every_allowed_type_survive(dtype: str) -> None:
    array = np.arange(6).reshape(2, 3).astype(dtype)
    back = unpack_array(memoryview(pack_array(array)))
    assert back.dtype == array.dtype
    np.testing.assert_array_equal(back, array)


def test_decoded_arrays_are_read_only_views_of_the_received_bytes() -> None:
    data = encode(scan(np.ones(100, np.float32)))
    ranges = decode(data, LaserScan).ranges
    assert not ranges.flags.writeable
    assert np.shares_memory(ranges, np.frombuffer(data, np.uint8))


@given(st.binary(max_size=200))
def test_any_bytes_decode_or_are_refused(data: bytes) -> None:
    for topic in ALL_TOPICS:
        with contextlib.suppress(MalformedMessageError):
            assert isinstance(decode(data, topic.type), topic.type)


@given(st.integers(0, 400), st.integers(0, 255))
def test_damaged_messages_decode_or_are_refused(position: int, value: int) -> None:
    data = bytearray(encode(scan(np.ones(80, np.float32))))
    data[position % len(data)] = value
    for damaged in (bytes(data), bytes(data[:position])):
        with contextlib.suppress(MalformedMessageError):
            assert isinstance(decode(damaged, LaserScan), LaserScan)


def test_columns_of_different_length_are_refused() -> None:
    joints = JointState(stamp_ns=0, names=("a", "b"), positions=np.zeros(2), velocities=np.zeros(3))
    with pytest.raises(MalformedMessageError, match=r"velocities.*J = 2"):
        decode(encode(joints), JointState)


def test_an_array_of_another_element_type_is_refused() -> None:
    with pytest.raises(MalformedMessageError, match="float32"):
        decode(encode(scan(np.ones(3, np.float64))), LaserScan)


def test_a_message_of_another_type_is_refused() -> None:
    with pytest.raises(MalformedMessageError, match="LaserScan"):
        decode(encode(Tick(stamp_ns=3)), LaserScan)


def test_objects_cannot_be_sent() -> None:
    with pytest.raises(TypeError, match="allowed"):
        pack_array(np.array([object()]))


def test_an_unknown_topic_names_those_that_exist() -> None:
    with pytest.raises(UnknownTopicError, match="map/belief"):
        topic_named("map/believe")


def test_topic_keys_and_ranks_are_unique() -> None:
    assert len({topic.key for topic in ALL_TOPICS}) == len(ALL_TOPICS)
    assert len({topic.rank for topic in ALL_TOPICS}) == len(ALL_TOPICS)


@given(poses, poses, poses)
def test_planar_poses_form_a_group(a: Pose2, b: Pose2, c: Pose2) -> None:
    left, right = (a @ b) @ c, a @ (b @ c)
    points = np.array([[1.0, 2.0], [-3.0, 0.5]])
    np.testing.assert_allclose(left.apply(points), right.apply(points), atol=1e-9)
    np.testing.assert_allclose((a @ a.inverse()).apply(points), points, atol=1e-9)
    np.testing.assert_allclose((a @ b).apply(points), a.apply(b.apply(points)), atol=1e-9)


@given(poses, poses)
def test_lifting_a_pose_into_space_keeps_composition(a: Pose2, b: Pose2) -> None:
    lifted: Pose3 = a.lifted() @ b.lifted()
    points = np.array([[1.0, 2.0, 0.7]])
    np.testing.assert_allclose(lifted.apply(points), (a @ b).lifted().apply(points), atol=1e-9)
    back = lifted.inverse().apply(lifted.apply(points))
    np.testing.assert_allclose(back, points, atol=1e-9)
