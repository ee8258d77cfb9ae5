"""The modelled perception keeps to its field of view, to occlusion and to its settings."""

import math
from dataclasses import replace

import numpy as np
import pytest

from robots.catalogue import robot_of
from robots.husky.spec import HUSKY
from robots.spec import CameraSpec
from schemas import topics
from schemas.codec import decode, encode
from schemas.geometry import Pose2
from schemas.perception import Detections
from schemas.run import RunConfig
from schemas.sensing import Odometry
from services.mapping.visibility import view_of
from services.policy.view import FieldOfView
from sim.experiments.perception_model import ModelledPerception, PerceptionSettings
from sim.scenes.model import Ground, PlacedObject, Sun, World

PERFECT = PerceptionSettings(
    detection_probability=1.0, false_per_picture=0.0, confusion=0.0, deviation_m=1e-6,
    deviation_per_metre=0.0,
)  # fmt: skip
DISC = robot_of(RunConfig(view_range_m=3.0, view_fov_rad=2 * math.pi)).camera
SECTOR = robot_of(RunConfig(view_range_m=3.0, view_fov_rad=math.radians(90))).camera

ORIGIN = Pose2(0.0, 0.0, 0.0)


def world_of(*objects: tuple[str, float, float]) -> World:
    placed = [
        PlacedObject(id=f"{label}_{n}", label=label, look=0, world_from_object=Pose2(x, y, 0.0))
        for n, (label, x, y) in enumerate(objects)
    ]
    return World(
        name="test", seed=0, ground=Ground(kind="grass", look=0), sun=Sun(azimuth=0, elevation=1),
        world_from_start=Pose2(0, 0, 0), objects=tuple(placed),
    )  # fmt: skip


def pictures(
    world: World,
    camera: CameraSpec,
    settings: PerceptionSettings = PERFECT,
    pose: Pose2 = ORIGIN,
    count: int = 1,
) -> list[Detections]:
    node = ModelledPerception(world, lambda: pose, camera, settings, np.random.default_rng(0))
    found: list[Detections] = []
    for n in range(count):
        odometry = Odometry(
            stamp_ns=n * 200_000_000, odom_from_base=pose, linear=0.0, angular=0.0,
            variance_per_metre=0.0, variance_per_radian=0.0,
        )  # fmt: skip
        for output in node.on_odometry(odometry):
            message = decode(encode(output.message), topics.DETECTIONS.type)
            found.append(message)
    return found


def test_the_disc_ends_at_its_radius() -> None:
    (picture,) = pictures(world_of(("cone", -2.9, 0.0), ("hydrant", 3.1, 0.0)), DISC)
    assert picture.centers_base[:, :2] == pytest.approx(np.array([[-2.9, 0.0]]), abs=1e-3)


def test_the_sector_does_not_look_back() -> None:
    world = world_of(("cone", -2.0, 0.0), ("hydrant", 2.0, 0.5))
    (picture,) = pictures(world, SECTOR)
    assert len(picture.scores) == 1
    assert picture.classes[int(picture.probabilities[0].argmax())] == "hydrant"


def test_positions_are_in_the_base_frame() -> None:
    pose = Pose2(4.0, 1.0, math.pi / 2)
    (picture,) = pictures(world_of(("cone", 4.0, 3.0)), DISC, pose=pose)
    assert picture.centers_base[0, :2] == pytest.approx([2.0, 0.0], abs=1e-3)


def test_what_stands_behind_a_thing_is_hidden_and_the_view_says_so() -> None:
    (picture,) = pictures(world_of(("cone", 1.0, 0.0), ("hydrant", 2.0, 0.0)), DISC)
    assert len(picture.scores) == 1
    view = view_of(picture, DISC)
    distance, bearing = np.array([2.0, 2.0]), np.array([0.0, 1.0])
    assert view.shows(distance, bearing).tolist() == [False, True]


@pytest.mark.parametrize("bearing", [0.0, 3.1, math.pi, -math.pi, -3.1])
def test_a_view_all_round_has_no_blind_seam(bearing: float) -> None:
    (picture,) = pictures(world_of(("cone", 20.0, 0.0)), DISC)
    view = view_of(picture, DISC)
    near_and_far = np.array([0.3, 2.9, 3.1])
    shown = view.shows(near_and_far, np.full(3, bearing))
    assert shown.tolist() == [True, True, False]
    assert view.detectable(near_and_far[:2]) == pytest.approx([0.9, 0.9])


def test_detection_and_false_rates_are_those_of_the_settings() -> None:
    settings = replace(PERFECT, detection_probability=0.7, false_per_picture=0.2)
    found = pictures(world_of(("cone", 2.0, 0.0)), DISC, settings, count=1500)
    true = [np.hypot(*(p.centers_base[:, :2] - (2.0, 0.0)).T) < 0.01 for p in found]
    assert np.mean([one.any() for one in true]) == pytest.approx(0.7, abs=0.04)
    assert np.mean([(~one).any() for one in true]) == pytest.approx(0.2, abs=0.04)


def test_stated_covariances_are_those_of_the_errors() -> None:
    settings = replace(PERFECT, deviation_m=0.05, deviation_per_metre=0.03)
    found = pictures(world_of(("cone", 2.0, 0.0)), DISC, settings, count=1000)
    errors = np.array([picture.centers_base[0, :2] - (2.0, 0.0) for picture in found])
    stated = float(np.mean([picture.covariances[0, 0, 0] for picture in found]))
    assert np.mean(errors**2) == pytest.approx(stated, rel=0.15)


def test_pictures_come_at_their_rate() -> None:
    assert len(pictures(world_of(("cone", 2.0, 0.0)), DISC, count=10)) == 10
    slow = replace(PERFECT, rate_hz=2.5)
    assert len(pictures(world_of(("cone", 2.0, 0.0)), DISC, slow, count=10)) == 5


def test_the_policy_expects_the_same_field_of_view() -> None:
    view = FieldOfView.of(DISC)
    assert view.half_angle == pytest.approx(math.pi)
    assert (view.range_max, view.near) == (3.0, 0.0)
    assert robot_of(RunConfig()) is HUSKY
