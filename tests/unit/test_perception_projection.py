"""Depth images are drawn by hand: a flat ground, a back wall, upright cylinders and a box."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.husky.spec import HUSKY
from schemas.geometry import Pose3
from schemas.sensing import Intrinsics
from services.perception.space.forms import Forms
from services.perception.space.projection import LocatedObject, locate
from services.perception.space.rays import axial_noise, camera_rays
from services.perception.space.support import support_height
from services.perception.space.surface import MEASURES, surface_in
from services.perception.space.view import bearings_count, ground_view
from services.perception.training.forms.fit import Example, learn_forms

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


def noisy(depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return depth + (depth > 0) * axial_noise(depth) * rng.normal(size=depth.shape)


def examples(count: int, rng: np.random.Generator) -> list[Example]:
    """Drums at random places, some of them cut by the picture's edge."""
    found: list[Example] = []
    while len(found) < count:
        center = (rng.uniform(1.8, 6.3), rng.uniform(-3.0, 3.0))
        mask = np.isfinite(cylinder_depth(center))
        if mask.sum() < 200:
            continue
        depth = noisy(sensed(cylinder_depth(center)), rng)
        surface = surface_in(box_around(mask), depth, RAYS, INTRINSICS, RANGE_MAX)
        if surface is not None:
            middle = np.array([*center, HEIGHT / 2])
            size = np.array([2 * RADIUS, 2 * RADIUS, HEIGHT])
            found.append(Example("drum", surface, middle, size))
    return found


@pytest.fixture(scope="module")
def forms() -> Forms:
    return Forms(learn_forms(examples(150, np.random.default_rng(5)), "drawn by hand"))


def located(box: np.ndarray, depth: np.ndarray, forms: Forms) -> LocatedObject | None:
    return locate(box, "drum", depth, RAYS, INTRINSICS, RANGE_MAX, forms)


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
def test_centre_is_right_within_its_covariance(
    x: float, slope: float, wall: float, seed: int, forms: Forms
):
    center = (x, slope * x)
    depth = sensed(cylinder_depth(center), wall_depth(x + wall))
    found = located(cylinder_box(center), noisy(depth, np.random.default_rng(seed)), forms)
    assert found is not None
    error = found.center - np.array([*center, HEIGHT / 2])
    assert mahalanobis(error, found.covariance) < 3
    assert np.linalg.norm(error) < max(0.05, 0.03 * x)
    np.testing.assert_allclose(found.size, [2 * RADIUS, 2 * RADIUS, HEIGHT], rtol=0.15)


def test_covariance_is_neither_too_small_nor_too_large(forms: Forms):
    held_out = examples(120, np.random.default_rng(6))
    squared = []
    for one in held_out:
        placed = forms.place(one.surface, "drum")
        squared.append(mahalanobis(placed.center - one.center, placed.covariance) ** 2)
    # Chi-squared of three degrees of freedom has 95 % below 7.8, and its median at 2.4.
    assert 0.2 < np.median(squared) < 3.0
    assert np.mean(np.array(squared) < 7.81) > 0.92


def test_a_thing_in_front_of_part_of_the_box_is_not_taken_for_it(forms: Forms):
    behind, box = (5.0, 0.0), cylinder_box((5.0, 0.0))
    depth = sensed(cylinder_depth(behind), cylinder_depth((3.0, 0.3)))
    found = located(box, depth, forms)
    assert found is not None
    assert abs(found.center[0] - 5.0) < 0.2


def test_covariance_is_symmetric_positive_and_grows_with_distance(forms: Forms):
    sizes = []
    for x in (2.5, 4.0, 6.0):
        depth = sensed(cylinder_depth((x, 0.3)))
        found = located(cylinder_box((x, 0.3)), depth, forms)
        assert found is not None
        np.testing.assert_allclose(found.covariance, found.covariance.T)
        assert np.linalg.eigvalsh(found.covariance).min() > 0
        sizes.append(np.trace(found.covariance[:2, :2]))
    assert sizes == sorted(sizes)


def test_an_object_cut_by_the_edge_is_less_certain(forms: Forms):
    whole, cut = (4.0, 0.0), (4.0, 2.6)
    found = [located(cylinder_box(c), sensed(cylinder_depth(c)), forms) for c in (whole, cut)]
    assert found[0] is not None
    assert found[1] is not None
    assert np.trace(found[1].covariance[:2, :2]) > 2 * np.trace(found[0].covariance[:2, :2])


@pytest.mark.parametrize("depth", [np.zeros((240, 320)), sensed(cylinder_depth((9.0, 0.0)))])
def test_an_object_without_depth_has_no_place(depth: np.ndarray, forms: Forms):
    box = cylinder_box((9.0, 0.0))
    assert located(box, depth, forms) is None


def test_an_object_beyond_the_range_has_no_place_though_its_depth_is_known(forms: Forms):
    depth = np.minimum(ground_depth(), cylinder_depth((9.0, 0.0)))
    box = cylinder_box((9.0, 0.0))
    assert located(box, depth, forms) is None
    assert locate(box, "drum", depth, RAYS, INTRINSICS, 10.0, forms) is not None


def test_bare_ground_in_a_box_is_no_object(forms: Forms):
    box = np.array([140, 150, 180, 190.0])
    assert located(box, sensed(), forms) is None


@given(box=st.tuples(*[st.floats(0, 320)] * 4).map(lambda b: (*sorted(b[::2]), *sorted(b[1::2]))))
@settings(deadline=None)
def test_any_box_in_the_picture_is_handled(forms: Forms, box: tuple[float, ...]):
    corners = np.clip(np.array(box)[[0, 2, 1, 3]], 0, [320, 240, 320, 240])
    found = located(corners, sensed(cylinder_depth((3.0, 0.0))), forms)
    assert found is None or np.isfinite(found.center).all()


def test_a_class_that_was_not_learned_has_the_form_of_any(forms: Forms):
    box, depth = cylinder_box((3.0, 0.2)), sensed(cylinder_depth((3.0, 0.2)))
    found = locate(box, "teapot", depth, RAYS, INTRINSICS, RANGE_MAX, forms)
    assert found is not None
    assert np.linalg.norm(found.center[:2] - (3.0, 0.2)) < 0.15


def test_what_stands_on_a_table_is_measured_from_the_table_up():
    table = 0.5
    down = -RAYS.directions[..., 2]
    on_top = np.where(down > 1e-6, (RAYS.origin[2] - table) / np.maximum(down, 1e-6), np.inf)
    x = RAYS.origin[0] + on_top * RAYS.directions[..., 0]
    top = np.where((x > 1.2) & (x < 2.6), on_top, np.inf)
    mask = np.isfinite(cylinder_depth((2.0, 0.0)))
    height = RAYS.origin[2] + cylinder_depth((2.0, 0.0)) * RAYS.directions[..., 2]
    mask &= height > table
    can = np.where(mask, cylinder_depth((2.0, 0.0)), np.inf)
    depth = sensed(top, can)
    box = box_around(mask)
    assert support_height(box, depth, RAYS) == pytest.approx(table, abs=0.02)
    surface = surface_in(box, depth, RAYS, INTRINSICS, RANGE_MAX)
    assert surface is not None
    assert surface.points[:, 2].min() > table
    assert surface.measures[MEASURES.index("high")] == pytest.approx(HEIGHT - table, abs=0.05)


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
