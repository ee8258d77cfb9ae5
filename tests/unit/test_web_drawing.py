import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from robots.colours import class_colour
from schemas.belief import OccupancyGrid
from schemas.task import Decision
from web.colours import cost_colours, linear
from web.decision_model import cheapest_places
from web.grid_model import center, looked_picture, magnified, occupancy_picture, size_m
from web.shapes import UNIT_BOX, UNIT_CONE, UNIT_CYLINDER, Instances, ellipse, polyline, wire_box


def signed_volume(mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(float) for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize(
    ("mesh", "volume"), [(UNIT_BOX, 1.0), (UNIT_CYLINDER, np.pi / 4), (UNIT_CONE, np.pi / 12)]
)
def test_meshes_are_closed_and_face_outwards(mesh, volume):
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    assert np.all(counts == 2)
    assert signed_volume(mesh) == pytest.approx(volume, rel=0.16)


def test_wire_box_has_the_twelve_edges():
    extent = np.array([1.0, 2.0, 3.0])
    segments = wire_box(np.array([5.0, 6.0, 7.0]), extent)
    lengths = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    assert_allclose(np.sort(lengths), np.repeat(extent, 4), rtol=1e-6)
    assert_allclose(segments.reshape(-1, 3).mean(0), (5, 6, 7), rtol=1e-6)


def test_every_point_of_the_ellipse_is_so_many_sigmas_away():
    covariance = np.array([[2.0, 0.6], [0.6, 0.5]])
    points = ellipse(np.array([1.0, -1.0]), covariance, 2.0, 0.1)[:, 0, :2] - (1.0, -1.0)
    squared = np.einsum("ni,ij,nj->n", points, np.linalg.inv(covariance), points)
    assert_allclose(squared, 4.0, rtol=1e-4)


def test_a_line_of_one_point_has_no_segments():
    assert polyline(np.zeros((1, 2)), 0.0).shape == (0, 2, 3)


@given(st.tuples(*[st.integers(0, 255)] * 3))
def test_linear_light_is_undone_by_the_transfer_curve(colour):
    light = linear(colour) / 255
    shown = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    assert np.all(np.abs(255 * shown - np.array(colour)) < 7)


def test_black_white_and_the_cheapest_keep_their_meaning():
    assert_allclose(linear((0, 0, 0)), 0)
    assert_allclose(linear((255, 255, 255)), 255)
    colours = cost_colours(np.array([3.0, 9.0, 6.0]))
    assert tuple(colours[0]) == (253, 231, 37)
    assert tuple(colours[1]) == (68, 1, 84)
    assert cost_colours(np.array([2.0, 2.0])).shape == (2, 3)
    assert cost_colours(np.zeros(0)).shape == (0, 3)


def test_classes_of_the_robot_are_told_apart():
    names = ("cone", "tree", "car", "building", "hydrant", "barrel")
    assert len({class_colour(name) for name in names}) == len(names)
    assert class_colour("something new") == class_colour("something new")


@pytest.fixture
def grid() -> OccupancyGrid:
    occupancy = np.zeros((3, 4), np.int8)
    occupancy[0, 0], occupancy[2, 3] = 30, -30
    looked = np.zeros((3, 4), np.int8)
    looked[2, 3], looked[1, 1] = -40, -5
    return OccupancyGrid(
        stamp_ns=0, origin=(-1.0, 2.0), resolution=0.5, occupancy=occupancy, looked=looked
    )


def test_grid_is_neither_flipped_nor_stretched(grid):
    picture = occupancy_picture(grid)
    assert picture[0, 0, :3].max() < 100
    assert picture[2, 3, :3].min() > 240
    assert picture[1, 1, 3] == 0
    assert size_m(grid) == (2.0, 1.5)
    assert center(grid) == (0.0, 2.75)


def test_tint_grows_with_the_certainty_that_nothing_is_there(grid):
    alpha = looked_picture(grid)[..., 3]
    assert alpha[2, 3] > alpha[1, 1] > 0
    assert alpha[0, 1] == 0


@given(st.lists(st.floats(0.05, 0.5), min_size=1, max_size=40))
def test_copies_keep_place_and_size_on_levels_that_never_move(opacities):
    n = len(opacities)
    positions = np.arange(3.0 * n).reshape(n, 3)
    copies = Instances(positions, np.full((n, 3), 0.5), np.array(opacities))
    levels = np.array([0.05, 0.1, 0.2, 0.5])
    shown = copies.on_levels(levels)
    visible = shown.extents[:, 0] > 0
    order = np.argsort(shown.positions[visible][:, 0])
    assert_allclose(shown.positions[visible][order], positions)
    nearest = levels[np.abs(np.array(opacities)[:, None] - levels).argmin(1)]
    assert_allclose(shown.opacities[visible][order], nearest)
    assert_allclose(shown.opacities, np.repeat(levels, len(shown.opacities) // 4))


def test_padding_keeps_the_number_of_copies_at_powers_of_two():
    sizes = [
        len(Instances.on_floor(np.zeros((n, 2)), 0.0).padded().positions) for n in (1, 3, 5, 8)
    ]
    assert sizes == [1, 4, 8, 8]


def test_of_candidates_about_one_place_the_cheapest_is_shown():
    decision = Decision(
        stamp_ns=0,
        instruction_id="a",
        kinds=("hypothesised",) * 4,
        positions=np.array([[1.0, 0.0], [1.1, 0.0], [5.0, 5.0], [9.0, 9.0]]),
        costs=np.array([4.0, 2.0, 3.0, np.inf]),
        chosen=1,
        confirmed=0.0,
        reason="",
    )
    positions, costs = cheapest_places(decision)
    assert_allclose(positions, [[1.1, 0.0], [5.0, 5.0]])
    assert_allclose(costs, [2.0, 3.0])


def test_magnifying_splits_cells_and_moves_none(grid):
    picture = occupancy_picture(grid)
    large = magnified(picture, grid.resolution)
    assert large.shape == (9, 12, 4)
    assert_allclose(large[1::3, 1::3], picture)
    assert magnified(picture, 0.05).shape == picture.shape
