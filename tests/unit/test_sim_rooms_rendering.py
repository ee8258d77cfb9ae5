"""Rooms and tags as the camera sees them."""

import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("sapien")

from robots.wheelchair.spec import WHEELCHAIR
from schemas.geometry import Pose2
from schemas.sensing import RgbdFrame
from services.perception.fiducials import TagReader, fiducials_in
from services.perception.training.places.frames import PlaceRenderer, read_places, write_places
from sim import vulkan
from sim.assets.tag import make_tag
from sim.scenes.rooms import ROOM_KINDS, Suite, empty_suite
from sim.scenes.rooms_furnished import furnished_suite

SPEC = WHEELCHAIR.camera


@pytest.fixture(scope="module", autouse=True)
def vulkan_device():
    vulkan.activate()
    try:
        return vulkan.device_name()
    except vulkan.NoVulkanDeviceError as error:
        pytest.skip(str(error))


def middle(suite: Suite, yaw: float) -> Pose2:
    x0, y0, x1, y1 = suite.rooms[0].floor
    return Pose2((x0 + x1) / 2, (y0 + y1) / 2, yaw)


@pytest.fixture(scope="module")
def studio():
    from sim.rendering.rooms import RoomStudio  # noqa: PLC0415

    return RoomStudio(SPEC)


@pytest.mark.parametrize("quarter", range(4))
def test_rooms_are_closed_on_all_sides(studio, quarter: int):
    """The sky is seen only where a neighbour's doorways lead nowhere, which they do not."""
    suite, rng = empty_suite(np.random.default_rng(3), "office"), np.random.default_rng(0)
    with studio.showing(suite, rng):
        base = middle(suite, quarter * math.pi / 2)
        picture = studio.camera.picture(base.lifted() @ SPEC.base_from_camera)
    assert np.mean(picture.entities == 0) < 0.001
    assert 0.1 < np.median(picture.depth) < 12


def test_a_suite_is_taken_off_the_scene_again(studio):
    suite, rng = furnished_suite(np.random.default_rng(3), "lounge"), np.random.default_rng(0)
    with studio.showing(suite, rng):
        pass
    picture = studio.camera.picture(middle(suite, 0.0).lifted() @ SPEC.base_from_camera)
    assert (picture.entities == 0).all()


def test_a_rendered_tag_is_found_where_it_hangs(studio):
    suite, rng = empty_suite(np.random.default_rng(8), "lab"), np.random.default_rng(1)
    base = middle(suite, 0.4)
    hung = base @ Pose2(2.0, 0.4, math.pi - 0.5)
    with studio.showing(suite, rng) as stage:
        half = hung.yaw / 2
        stage.put(make_tag(12, 0.3), [hung.x, hung.y, 1.2], [math.cos(half), 0, 0, math.sin(half)])
        picture = studio.camera.picture(base.lifted() @ SPEC.base_from_camera)
    frame = RgbdFrame(
        stamp_ns=0,
        color=picture.color,
        depth_mm=np.zeros(picture.depth.shape, np.uint16),
        intrinsics=studio.camera.intrinsics,
        base_from_camera=SPEC.base_from_camera,
        odom_from_base=Pose2(0.0, 0.0, 0.0),
    )
    found = fiducials_in(frame, TagReader(), 0.3)
    assert found.ids.tolist() == [12]
    np.testing.assert_allclose(found.positions_base[0], [2.0, 0.4, 1.2], atol=0.03)


def test_pictures_of_places_repeat_and_are_labelled():
    renderer = PlaceRenderer()
    number = ROOM_KINDS.index("kitchen")
    first, again = renderer.pictures(5, number), renderer.pictures(5, number)
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.windows, other.windows)
        assert (one.here, one.ahead.tolist()) == (other.here, other.ahead.tolist())
        assert one.windows.shape == (3, 120, 160, 3)
    assert any(picture.here == number for picture in first)


@pytest.mark.slow
def test_a_data_set_of_places_is_resumed_not_begun_again(tmp_path: Path):
    write_places(tmp_path, 64, seed=2)
    picture = tmp_path / "frames" / "000000.jpg"
    written = picture.stat().st_mtime_ns
    done: list[tuple[int, int]] = []
    write_places(tmp_path, 64, seed=2, progress=lambda at, count: done.append((at, count)))
    assert done == [(64, 64)]
    assert picture.stat().st_mtime_ns == written
    pictures = read_places(tmp_path)
    assert len(pictures) == 64
    assert {picture.here for picture in pictures} >= set(range(len(ROOM_KINDS)))
