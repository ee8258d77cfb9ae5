"""Windows, points and distributions of the classifier of places, and the process around it."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.tags import place_types
from robots.wheelchair.spec import WHEELCHAIR
from schemas import topics
from schemas.codec import decode, encode
from schemas.geometry import Pose2, Pose3
from schemas.perception import Fiducials, SceneObservation
from schemas.run import RunConfig
from schemas.sensing import Intrinsics, RgbdFrame
from services.mapping.looks import log_likelihoods
from services.mapping.soundness import flaw_of
from services.perception.errors import MissingWeightsError
from services.perception.places.classifier import (
    PlaceClassifier,
    among,
    default_places,
    pooled,
    softmax,
)
from services.perception.places.windows import (
    network_input,
    points_ahead,
    window_pictures,
    windows_of,
)
from services.perception.scenes_node import ScenesNode
from services.perception.space.rays import camera_rays
from sim.assets.tag import tag_texture
from sim.scenes.rooms import ROOM_KINDS

SPEC = WHEELCHAIR.camera
FOCAL = SPEC.width / 2 / math.tan(SPEC.horizontal_fov / 2)
CAMERA = Intrinsics(SPEC.width, SPEC.height, FOCAL, FOCAL, 479.5, 119.5)


@pytest.mark.parametrize(
    ("size", "columns"),
    [
        ((320, 240), [(0, 320)]),
        ((640, 480), [(0, 640)]),
        ((960, 240), [(0, 320), (320, 640), (640, 960)]),
        ((1280, 720), [(0, 960), (320, 1280)]),
        ((240, 320), [(0, 240)]),
    ],
)
def test_windows_cover_the_picture(size: tuple[int, int], columns: list[tuple[int, int]]):
    assert [(one.start, one.stop) for one in windows_of(*size)] == columns


def test_windows_are_small_upright_pictures():
    color = np.zeros((240, 960, 3), np.uint8)
    color[:, 320:640, 1] = 200
    windows = window_pictures(color)
    assert windows.shape == (3, 120, 160, 3)
    assert windows.mean((1, 2))[:, 1].tolist() == [0, 200, 0]
    blob = network_input(windows[1])
    assert blob.shape == (1, 3, 128, 160)
    assert blob[0, 1, 0, 0] == pytest.approx(200 / 255)
    assert blob[0, 0, 127, 0] == pytest.approx(114 / 255)


def test_points_lie_before_what_the_windows_show():
    """A wall across, 5 m ahead of the camera: depth is the same in every pixel."""
    points = points_ahead(np.full((240, 960), 5.0), camera_rays(CAMERA, SPEC.base_from_camera))
    assert points.shape == (3, 2)
    mount = SPEC.base_from_camera.position[0]
    assert points[1, 0] == pytest.approx(mount + 4.0, abs=0.15)
    assert points[1, 1] == pytest.approx(0.0, abs=0.05)
    # The left window comes first, and left is +y.
    assert points[0, 1] > 1.5
    assert points[2, 1] < -1.5


def test_without_depth_there_are_no_points():
    nothing = points_ahead(np.zeros((240, 960)), camera_rays(CAMERA, SPEC.base_from_camera))
    assert np.isnan(nothing).all()


@settings(deadline=None)
@given(st.integers(0, 2**31), st.floats(0.4, 4.0), st.floats(0.0, 1.0), st.integers(1, 4))
def test_pooled_looks_are_a_distribution_that_no_order_changes(
    seed: int, temperature: float, pooling: float, windows: int
):
    logits = np.random.default_rng(seed).normal(0, 3, (windows, 8))
    row = pooled(logits, temperature, pooling)
    assert row.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(pooled(logits[::-1], temperature, pooling), row)
    np.testing.assert_allclose(
        pooled(logits[:1], temperature, pooling), softmax(logits[0] / temperature)
    )


def test_looks_that_say_the_same_thrice_are_worth_once_to_thrice():
    logits = np.tile(np.array([2.0, 0.0, 0.0]), (3, 1))
    once = softmax(logits[0])[0]
    assert pooled(logits, 1.0, 1.0)[0] == pytest.approx(once)
    assert pooled(logits, 1.0, 0.5)[0] > once
    assert pooled(logits, 1.0, 0.0)[0] == pytest.approx(softmax(3 * logits[0])[0])


def test_types_that_do_not_matter_are_left_out_and_the_odds_kept():
    known, types = ("kitchen", "office", "lab", "lounge"), ("lab", "office")
    row = among(np.array([[0.1, 0.6, 0.2, 0.1]]), known, types)
    np.testing.assert_allclose(row, [[0.25, 0.75]])
    np.testing.assert_allclose(among(np.array([[0.7, 0.1, 0.1, 0.1]]), known, types), [[0.5, 0.5]])


def test_missing_weights_say_how_to_make_them(tmp_path: Path):
    with pytest.raises(MissingWeightsError, match="incognita train places"):
        PlaceClassifier(tmp_path / "places.onnx")


needs_weights = pytest.mark.skipif(
    not default_places.is_file(), reason="`incognita train places` makes the weights"
)


def frame_with(tag: int | None = None, stamp_ns: int = 1) -> RgbdFrame:
    """A grey corridor end 3 m ahead, maybe with a tag of 56 px on it."""
    color = np.full((240, 960, 3), 150, np.uint8)
    if tag is not None:
        color[90:160, 440:510] = (
            np.asarray(tag_texture(tag))[5::16, 5::16].repeat(7, 0).repeat(7, 1)
        )
    return RgbdFrame(
        stamp_ns=stamp_ns,
        color=color,
        depth_mm=np.full((240, 960), 3000, np.uint16),
        intrinsics=CAMERA,
        base_from_camera=Pose3(SPEC.base_from_camera.position, SPEC.base_from_camera.wxyz),
        odom_from_base=Pose2(1.0, 2.0, 0.3),
    )


@pytest.fixture(scope="module")
def node() -> ScenesNode:
    return ScenesNode(RunConfig(robot="wheelchair"), np.random.default_rng(0))


def scenes_of(node: ScenesNode, frame: RgbdFrame) -> list[SceneObservation | Fiducials]:
    return [output.message for output in node.handlers()[topics.RGBD](frame)]


@needs_weights
def test_what_the_process_says_is_evidence_for_the_filter(node: ScenesNode):
    (scene,) = scenes_of(node, frame_with(stamp_ns=1_000_000_000))
    assert isinstance(scene, SceneObservation)
    received = decode(encode(scene), SceneObservation)
    assert flaw_of(received) == ""
    np.testing.assert_allclose(received.probabilities.sum(axis=1), 1.0)
    assert received.points_base[0].tolist() == [0.0, 0.0]
    assert len(received.points_base) == 4
    assert set(received.types) == set(ROOM_KINDS) == set(place_types(WHEELCHAIR))
    looks = log_likelihoods(received, WHEELCHAIR.symbols.locations)
    assert looks.shape == (4, len(WHEELCHAIR.symbols.locations))


@needs_weights
def test_a_tag_adds_a_point_that_is_nearly_sure(node: ScenesNode):
    tags, scene = scenes_of(node, frame_with(tag=3, stamp_ns=3_000_000_000))
    assert isinstance(tags, Fiducials)
    assert isinstance(scene, SceneObservation)
    assert tags.ids.tolist() == [3]
    assert len(scene.points_base) == 5
    assert scene.types[int(scene.probabilities[-1].argmax())] == place_types(WHEELCHAIR)[3]
    assert scene.probabilities[-1].max() > 0.9


@needs_weights
def test_looks_from_the_same_spot_are_not_repeated_at_every_frame(node: ScenesNode):
    stamps = [5_000_000_000 + 200_000_000 * number for number in range(6)]
    said = [len(scenes_of(node, frame_with(stamp_ns=stamp))) for stamp in stamps]
    assert said == [1, 0, 1, 0, 1, 0]


@needs_weights
def test_committed_weights_say_what_they_are():
    card = PlaceClassifier().card
    assert card.types == ROOM_KINDS
    assert card.licence == "Apache-2.0"
    assert card.parameters <= 300_000
    assert default_places.stat().st_size < 1_000_000
    assert card.here is not None
    assert card.here.accuracy > 2 / len(card.types)
