"""Depth images are drawn by hand: a flat ground, a back wall, and an upright cylinder."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.husky.spec import HUSKY
from schemas.geometry import Pose3
from schemas.sensing import Intrinsics
from services.perception.projection import locate
from services.perception.rays import axial_noise, camera_rays
from services.perception.view import bearings_count, ground_view

FOCAL = 160 / math.tan(HUSKY.camera.horizontal_fov / 2)
INTRINSICS = Intrinsics(320, 240, FOCAL, FOCAL, 159.5, 119.5)
MOUNT = HUSKY.camera.base_from_camera
RAYS = camera_rays(INTRINSICS, MOUNT)
RANGE_MAX = 7.0
RADIUS, HEIGHT = 0.25, 0.8


def ground_depth() -> np.ndarray:
    down = -RAYS.directions[..., 2]
    return np.where(down > 1e-6, RAYS.origin[2] / np.maximum(down, 1e-6), np.inf)


def wall_depth(x: float) -> np.ndarray:
    return (x - RAYS.origin[0]) / RAYS.directions[..., 0]


def cylinder_depth(center: tuple[float, float]) -> np.ndarray:
    """Depth at which each ray enters an upright cylinder, infinite where it passes by."""
    d, offset = RAYS.directions[..., :2], RAYS.origin[:2] - center
    a, b = (d**2).sum(-1), (d * offset).sum(-1)
    root = b**2 - a * ((offset**2).sum() - RADIUS**2)
    depth = (-b - np.sqrt(np.maximum(root, 0))) / a
    top = RAYS.origin[2] + depth * RAYS.directions[..., 2]
    return np.where((root > 0) & (top > 0) & (top < HEIGHT), depth, np.inf)


def sensed(*surfaces: np.ndarray) -> np.ndarray:
    depth = np.minimum.reduce([ground_depth(), *surfaces])
    return np.where(depth > RANGE_MAX, 0.0, depth)


def box_around(mask: np.ndarray) -> np.ndarray:
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    return np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], float)


def cylinder_box(center: tuple[float, float]) -> np.ndarray:
    return box_around(np.isfinite(cylinder_depth(center)))


def mahalanobis(error: np.ndarray, covariance: np.ndarray) -> float:
    return float(np.sqrt(error @ np.linalg.solve(covariance, error)))


def test_rays_meet_the_ground_where_the_camera_looks():
    u, v = 40, 200
    point = RAYS.points(ground_depth())[v, u]
    np.testing.assert_allclose(point[:2], RAYS.ground[v, u])
    assert point[2] == pytest.approx(0, abs=1e-9)
    in_camera = MOUNT.inverse().apply(point)
    assert FOCAL * in_camera[0] / in_camera[2] + INTRINSICS.cx == pytest.approx(u)
    assert FOCAL * in_camera[1] / in_camera[2] + INTRINSICS.cy == pytest.approx(v)


@settings(max_examples=30, deadline=None)
@given(
    x=st.floats(2.5, 6.0),
    slope=st.floats(-0.4, 0.4),
    wall=st.sampled_from([0.6, 1.5, 20.0]),
    seed=st.integers(0, 1000),
)
def test_centre_is_right_within_its_covariance(x: float, slope: float, wall: float, seed: int):
    center = (x, slope * x)
    rng = np.random.default_rng(seed)
    depth = sensed(cylinder_depth(center), wall_depth(x + wall))
    depth += (depth > 0) * axial_noise(depth) * rng.normal(size=depth.shape)
    found = locate(cylinder_box(center), depth, RAYS, INTRINSICS, RANGE_MAX)
    assert found is not None
    error = found.center - np.array([*center, HEIGHT / 2])
    assert mahalanobis(error, found.covariance) < 3
    assert np.linalg.norm(error[:2]) < 0.15
    np.testing.assert_allclose(found.extents, [2 * RADIUS, 2 * RADIUS, HEIGHT], rtol=0.3)


def test_a_thing_in_front_of_part_of_the_box_is_not_taken_for_it():
    behind, box = (5.0, 0.0), cylinder_box((5.0, 0.0))
    depth = sensed(cylinder_depth(behind), cylinder_depth((3.0, 0.3)))
    found = locate(box, depth, RAYS, INTRINSICS, RANGE_MAX)
    assert found is not None
    assert abs(found.center[0] - 5.0) < 0.2


def test_covariance_is_symmetric_positive_and_grows_with_distance():
    sizes = []
    for x in (2.5, 4.0, 6.0):
        depth = sensed(cylinder_depth((x, 0.3)))
        found = locate(cylinder_box((x, 0.3)), depth, RAYS, INTRINSICS, RANGE_MAX)
        assert found is not None
        np.testing.assert_allclose(found.covariance, found.covariance.T)
        assert np.linalg.eigvalsh(found.covariance).min() > 0
        sizes.append(np.trace(found.covariance[:2, :2]))
    assert sizes == sorted(sizes)


def test_an_object_cut_by_the_edge_is_less_certain():
    whole, cut = (4.0, 0.0), (4.0, 2.6)
    found = [
        locate(cylinder_box(c), sensed(cylinder_depth(c)), RAYS, INTRINSICS, RANGE_MAX)
        for c in (whole, cut)
    ]
    assert found[0] is not None
    assert found[1] is not None
    assert np.trace(found[1].covariance[:2, :2]) > 2 * np.trace(found[0].covariance[:2, :2])


@pytest.mark.parametrize("depth", [np.zeros((240, 320)), sensed(cylinder_depth((9.0, 0.0)))])
def test_an_object_without_depth_has_no_place(depth: np.ndarray):
    box = cylinder_box((9.0, 0.0))
    assert locate(box, depth, RAYS, INTRINSICS, RANGE_MAX) is None


def test_an_object_beyond_the_range_has_no_place_though_its_depth_is_known():
    depth = np.minimum(ground_depth(), cylinder_depth((9.0, 0.0)))
    assert locate(cylinder_box((9.0, 0.0)), depth, RAYS, INTRINSICS, RANGE_MAX) is None
    assert locate(cylinder_box((9.0, 0.0)), depth, RAYS, INTRINSICS, 10.0) is not None


def test_bare_ground_in_a_box_is_no_object():
    box = np.array([140, 150, 180, 190.0])
    assert locate(box, sensed(), RAYS, INTRINSICS, RANGE_MAX) is None


@given(box=st.tuples(*[st.floats(0, 320)] * 4).map(lambda b: (*sorted(b[::2]), *sorted(b[1::2]))))
@settings(deadline=None)
def test_any_box_in_the_picture_is_handled(box: tuple[float, ...]):
    corners = np.clip(np.array(box)[[0, 2, 1, 3]], 0, [320, 240, 320, 240])
    found = locate(corners, sensed(cylinder_depth((3.0, 0.0))), RAYS, INTRINSICS, RANGE_MAX)
    assert found is None or np.isfinite(found.center).all()


def test_free_ground_is_seen_to_the_range_limit():
    view = ground_view(sensed(), INTRINSICS, MOUNT, RANGE_MAX)
    assert len(view.bearings) == len(view.ranges) == bearings_count
    assert (np.diff(view.bearings) > 0).all()
    np.testing.assert_allclose(view.bearings, -view.bearings[::-1], atol=0.01)
    assert (view.ranges >= RANGE_MAX - 0.5).all()
    assert (view.ranges <= RANGE_MAX).all()
    assert 1.3 < view.near < 1.8


def test_ground_behind_an_occluder_is_not_seen():
    center = (3.5, 0.6)
    view = ground_view(sensed(cylinder_depth(center)), INTRINSICS, MOUNT, RANGE_MAX)
    distance, bearing = math.hypot(*center), math.atan2(center[1], center[0])
    half = math.asin(RADIUS / distance)
    behind = np.abs(view.bearings - bearing) < 0.6 * half
    beside = np.abs(view.bearings - bearing) > half + 0.06
    assert behind.sum() >= 2
    assert (np.abs(view.ranges[behind] - (distance - RADIUS)) < 0.5).all()
    assert (view.ranges[beside] >= RANGE_MAX - 0.5).all()


def test_a_wall_ends_the_view_everywhere():
    view = ground_view(sensed(wall_depth(4.0)), INTRINSICS, MOUNT, RANGE_MAX)
    np.testing.assert_allclose(view.ranges * np.cos(view.bearings), 4.0, atol=0.1)


def test_without_depth_nothing_was_seen():
    view = ground_view(np.zeros((240, 320)), INTRINSICS, MOUNT, RANGE_MAX)
    assert (view.ranges < view.near + 0.25).all()


def test_scattered_holes_and_a_pitching_base_do_not_end_the_view():
    rng = np.random.default_rng(0)
    w, x, y, z = MOUNT.wxyz
    pitched = Pose3(MOUNT.position, (w, x, y, z))
    depth = sensed()
    depth[rng.random(depth.shape) < 0.3] = 0
    view = ground_view(depth, INTRINSICS, pitched, RANGE_MAX)
    assert (view.ranges >= RANGE_MAX - 0.75).all()
