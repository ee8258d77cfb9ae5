import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from robots.husky.spec import HUSKY
from robots.tags import TagPlace, TagTable, TagTableError, place_types, read_tags, tag_table
from robots.wheelchair.spec import WHEELCHAIR
from schemas.codec import decode, encode
from schemas.geometry import Pose2, Pose3
from schemas.perception import Fiducials
from schemas.run import RunConfig
from schemas.sensing import Intrinsics, RgbdFrame
from services.perception.fiducials import (
    TagReader,
    fiducials_in,
    place_rows,
    quaternion,
    tag_pose,
)
from sim.assets.tag import tag_texture

CAMERA = Intrinsics(960, 240, 277.0, 277.0, 479.5, 119.5)
SIDE = 0.3
AHEAD = Pose3((0.2, 0.0, 1.1), (0.5, -0.5, 0.5, -0.5))


def facing(distance: float, turn: float = 0.0, aside: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and position in the camera frame of a tag turned about the upright axis."""
    c, s = math.cos(turn), math.sin(turn)
    # Facing the camera: tag x is camera x, tag y is up, tag z points back.
    level = np.diag([1.0, -1.0, -1.0])
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ level, np.array([aside, 0.05, distance])


def projected(rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
    corners = SIDE / 2 * np.array([(-1.0, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)])
    x, y, z = (corners @ rotation.T + position).T
    return np.stack([CAMERA.fx * x / z + CAMERA.cx, CAMERA.fy * y / z + CAMERA.cy], axis=1)


def picture_of(number: int, rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
    """A grey picture with one tag, drawn by a homography four times as fine and then averaged."""
    texture, fine = tag_texture(number), 4
    rim = texture.shape[0] / 10
    inner = np.array([(rim, rim), (9 * rim, rim), (9 * rim, 9 * rim), (rim, 9 * rim)]) - 0.5
    target = (projected(rotation, position) + 0.5) * fine - 0.5
    warp = cv2.getPerspectiveTransform(inner.astype(np.float32), target.astype(np.float32))
    size = (CAMERA.width * fine, CAMERA.height * fine)
    drawn = cv2.warpPerspective(texture, warp, size, borderValue=(150, 150, 150))
    small = cv2.resize(drawn, (CAMERA.width, CAMERA.height), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.uint8)


def frame_of(color: np.ndarray) -> RgbdFrame:
    return RgbdFrame(
        stamp_ns=5,
        color=color,
        depth_mm=np.zeros(color.shape[:2], np.uint16),
        intrinsics=CAMERA,
        base_from_camera=AHEAD,
        odom_from_base=Pose2(1.0, 2.0, 0.5),
    )


@pytest.fixture(scope="module")
def reader() -> TagReader:
    return TagReader()


@pytest.mark.parametrize(("distance", "turn"), [(1.0, 0.0), (1.0, 0.7), (2.0, -0.5), (3.0, 0.3)])
def test_a_tag_is_read_and_found_where_it_hangs(reader: TagReader, distance: float, turn: float):
    rotation, position = facing(distance, turn, aside=0.2)
    found = fiducials_in(frame_of(picture_of(17, rotation, position)), reader, SIDE)
    assert found.ids.tolist() == [17]
    np.testing.assert_allclose(found.corners_px[0], projected(rotation, position), atol=0.5)
    truth = AHEAD.apply(position)
    assert np.linalg.norm(found.positions_base[0] - truth) < 0.02 * distance
    error = found.positions_base[0] - truth
    assert error @ np.linalg.solve(found.covariances[0, :3, :3], error) < 16


def test_a_tag_in_dim_light_is_read_through_the_noise_of_the_camera(reader: TagReader):
    rotation, position = facing(2.0, 0.4, aside=0.2)
    bright = picture_of(17, rotation, position)
    noise = np.random.default_rng(0).normal(0, 4, bright.shape)
    dim = np.clip(20 + bright / 8 + noise, 0, 255).astype(np.uint8)
    numbers, corners = reader.read(dim)
    assert numbers.tolist() == [17]
    np.testing.assert_allclose(corners[0], projected(rotation, position), atol=1.0)


def test_a_picture_without_tags_gives_an_empty_message_that_survives_the_wire(reader: TagReader):
    found = fiducials_in(frame_of(np.full((240, 960, 3), 90, np.uint8)), reader, SIDE)
    received = decode(encode(found), Fiducials)
    assert received.ids.shape == (0,)
    assert received.covariances.shape == (0, 6, 6)


@settings(deadline=None)
@given(
    distance=st.floats(0.5, 6.0),
    turn=st.floats(-1.1, 1.1),
    aside=st.floats(-1.0, 1.0),
)
def test_exact_corners_give_the_exact_pose(distance: float, turn: float, aside: float):
    rotation, position = facing(distance, turn, aside)
    found = tag_pose(projected(rotation, position), CAMERA, SIDE)
    np.testing.assert_allclose(found.position, position, atol=1e-5 * distance)
    assert np.all(np.linalg.eigvalsh(found.covariance) > 0)


def test_uncertainty_grows_with_range_and_with_the_angle():
    def deviation(distance: float, turn: float) -> float:
        pose = tag_pose(projected(*facing(distance, turn)), CAMERA, SIDE)
        return math.sqrt(pose.covariance[2, 2])

    near, middle, far = (deviation(distance, 0.4) for distance in (1.0, 2.0, 4.0))
    assert near < middle < far
    assert far > 4.5 * near
    assert deviation(3.0, 1.2) > deviation(3.0, 0.6)


def test_a_tag_seen_head_on_from_afar_does_not_know_which_way_it_leans():
    """Its two solutions fit alike: the covariance must hold both."""
    rotation, position = facing(6.0, 0.1)
    found = tag_pose(projected(rotation, position), CAMERA, SIDE)
    assert math.sqrt(found.covariance[4, 4]) > 0.1


@settings(deadline=None)
@example(0.0, 0.0, 1.9e-6)
@given(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
def test_quaternion_is_the_inverse_of_the_matrix(a: float, b: float, c: float):
    rotation = np.asarray(cv2.Rodrigues(np.array([a, b, c]))[0])
    w, x, y, z = quaternion(rotation).tolist()
    again = Pose3((0.0, 0.0, 0.0), (w, x, y, z)).rotation()
    np.testing.assert_allclose(again, rotation, atol=1e-9)


def seen(number: int) -> Fiducials:
    """A tag 2 m ahead of the base that faces it."""
    out = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    return Fiducials(
        stamp_ns=1,
        family="36h11",
        odom_from_base=Pose2(0, 0, 0),
        ids=np.array([number], np.int32),
        corners_px=np.zeros((1, 4, 2)),
        positions_base=np.array([[2.0, 0.0, 1.0]]),
        wxyz_base=quaternion(out)[None],
        covariances=np.eye(6)[None],
    )


def test_a_tag_speaks_of_the_place_before_it_with_its_error_rate():
    types = ("kitchen", "office", "lab")
    table = TagTable(tags={4: TagPlace(place="office", before_m=0.5)}, error_rate=0.1)
    points, rows = place_rows(seen(4), table, types)
    np.testing.assert_allclose(points, [[1.5, 0.0]], atol=1e-9)
    np.testing.assert_allclose(rows, [[0.05, 0.9, 0.05]])
    assert place_rows(seen(5), table, types)[0].shape == (0, 2)


def test_without_a_table_tags_number_the_places_of_the_robot():
    table = tag_table(RunConfig(robot="wheelchair"), WHEELCHAIR)
    assert [table.tags[i].place for i in range(len(table.tags))] == list(place_types(WHEELCHAIR))
    assert tag_table(RunConfig(), HUSKY).tags == {}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"tags": {"3": {"place": "garage"}}}, ["garage", "kitchen", "tag 3"]),
        ({"tags": {"900": {"place": "kitchen"}}}, ["900", "586"]),
        ({"tags": {}, "side_m": -1}, ["side_m", "-1"]),
        ({"tags": {}, "error_rate": 1.0}, ["error_rate"]),
        ({"tag": {}}, ["tag"]),
    ],
)
def test_a_table_that_cannot_be_used_is_refused_with_the_reason(
    tmp_path: Path, content: dict, words: list[str]
):
    path = tmp_path / "tags.json"
    path.write_text(json.dumps(content))
    with pytest.raises(TagTableError) as refused:
        read_tags(path, place_types(WHEELCHAIR))
    assert all(word in str(refused.value) for word in [*words, str(path)])


def test_a_table_is_read_from_the_file_of_the_run(tmp_path: Path):
    path = tmp_path / "tags.json"
    path.write_text('{"side_m": 0.2, "tags": {"7": {"place": "lab", "before_m": -0.6}}}')
    table = tag_table(RunConfig(robot="wheelchair", tags=str(path)), WHEELCHAIR)
    assert (table.side_m, table.tags[7].place, table.tags[7].before_m) == (0.2, "lab", -0.6)
