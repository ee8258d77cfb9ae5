"""The grid: beams free and fill cells; looking rules out what was looked at and nothing else."""

import math

import numpy as np
import pytest

from schemas import codec, topics
from schemas.belief import OccupancyGrid
from schemas.geometry import Pose2
from schemas.run import RunConfig
from schemas.sensing import LaserScan
from services.mapping.grid import Grid
from services.mapping.node import MappingNode
from services.mapping.visibility import View, log_floor, look

ORIGIN = Pose2(0.0, 0.0, 0.0)


def scan(ranges: np.ndarray, stamp_ns: int = 0, odom: Pose2 = ORIGIN) -> LaserScan:
    return LaserScan(
        stamp_ns=stamp_ns,
        angle_min=-math.pi,
        angle_increment=2 * math.pi / 360,
        range_max=20.0,
        ranges=ranges.astype(np.float32),
        base_from_laser=ORIGIN,
        odom_from_base=odom,
    )


def cell(grid: Grid, x: float, y: float) -> float:
    column, row = ((np.array([x, y]) - grid.origin) / 0.2).astype(int)
    return float(grid.occupancy[row, column])


def test_a_wall_is_occupied_the_way_to_it_free_and_behind_it_unknown() -> None:
    grid = Grid((0.0, 0.0))
    angles = -math.pi + 2 * math.pi / 360 * np.arange(360)
    with np.errstate(divide="ignore"):
        ranges = np.where(np.cos(angles) > 0.2, 4.05 / np.cos(angles), np.inf)
    for _ in range(5):
        grid.insert(scan(ranges), ORIGIN)
    assert cell(grid, 4.05, 0.05) > 1
    assert cell(grid, 2.0, 0.5) < -1
    assert cell(grid, 6.0, 0.0) == 0
    assert cell(grid, -6.0, 0.0) < -1


def test_the_same_wall_seen_from_another_pose_is_the_same_cells() -> None:
    grid, moved = Grid((0.0, 0.0)), Pose2(1.0, 0.0, math.pi / 2)
    one = np.full(360, np.inf)
    one[180] = 4.05
    grid.insert(scan(one), ORIGIN)
    other = np.full(360, np.inf)
    other[90] = 3.05
    grid.insert(scan(other), moved)
    assert cell(grid, 4.05, 0.05) == pytest.approx(1.8)


def test_nan_and_infinite_ranges_do_no_harm() -> None:
    grid = Grid((0.0, 0.0))
    grid.insert(scan(np.full(360, np.nan)), ORIGIN)
    assert not grid.occupancy.any()


def test_the_grid_grows_and_keeps_what_it_knew() -> None:
    grid = Grid((0.0, 0.0))
    ranges = np.full(360, np.inf)
    ranges[180] = 3.05
    grid.insert(scan(ranges), ORIGIN)
    grid.cover(-70.0, 40.0)
    assert cell(grid, 3.05, 0.05) == pytest.approx(0.9)
    grid.insert(scan(ranges), Pose2(-70.0, 40.0, 0.0))
    assert cell(grid, -66.95, 40.05) == pytest.approx(0.9)


def view(reach: float = 6.0) -> View:
    bearings = np.linspace(-0.6, 0.6, 41)
    ranges = np.where(np.abs(bearings) < 0.1, 3.0, 9.0)
    return View(bearings, ranges, 0.8, reach)


def test_looking_lowers_what_was_in_view_and_nothing_else() -> None:
    grid, pose = Grid((0.0, 0.0)), Pose2(2.0, 1.0, math.pi / 2)
    look(grid, view(), pose, np.array([[4.0, 1.5]]))
    seen = pose.apply(np.array([[2.0, 0.5], [2.0, 0.0], [3.0, 1.0]]))
    assert (grid.looked_at(seen) < math.log(0.2)).all()
    hidden = [[4.0, 0.0], [0.4, 0.0], [2.0, 1.9], [-2.0, 0.0], [8.0, 2.0], [4.0, 1.6]]
    np.testing.assert_array_equal(grid.looked_at(pose.apply(np.array(hidden))), 0.0)


def test_looking_again_never_raises_and_stops_at_the_floor() -> None:
    grid, near, far = Grid((0.0, 0.0)), np.array([2.0, 0.5]), np.array([5.5, 1.5])
    before = np.zeros(2)
    for _ in range(8):
        look(grid, view(), ORIGIN, np.zeros((0, 2)))
        now = grid.looked_at(np.array([near, far]))
        assert (now <= before).all()
        before = now
    assert before[0] == pytest.approx(log_floor, abs=1e-3)
    assert log_floor < before[1] < -0.5


def test_a_published_grid_is_taken_up_again() -> None:
    grid, heir = Grid((0.0, 0.0)), Grid((50.0, 0.0))
    ranges = np.full(360, 3.05)
    grid.insert(scan(ranges), ORIGIN)
    look(grid, view(), ORIGIN, np.zeros((0, 2)))
    heir.restore(codec.decode(codec.encode(grid.message(7)), OccupancyGrid))
    np.testing.assert_allclose(heir.occupancy, grid.occupancy, atol=0.051)
    np.testing.assert_allclose(heir.looked, grid.looked, atol=0.051)
    heir.insert(scan(ranges), ORIGIN)


def test_the_node_publishes_the_grid_twice_a_second() -> None:
    node = MappingNode(RunConfig(), np.random.default_rng(0))
    ranges = np.full(360, 5.0)
    count = sum(
        output.topic is topics.GRID
        for tick in range(40)
        for output in node.on_scan(scan(ranges, tick * 100_000_000))
    )
    assert count == 8


@pytest.mark.parametrize(("robot", "resolution"), [("husky", 0.2), ("wheelchair", 0.1)])
def test_the_robot_says_how_fine_its_grid_is(robot: str, resolution: float) -> None:
    node = MappingNode(RunConfig(robot=robot), np.random.default_rng(0))
    (output,) = node.on_scan(scan(np.full(360, 5.0)))
    assert isinstance(output.message, OccupancyGrid)
    assert output.message.resolution == resolution


def test_fine_cells_show_the_same_wall_in_the_same_place() -> None:
    coarse, fine = Grid((0.0, 0.0)), Grid((0.0, 0.0), 0.1)
    for grid in (coarse, fine):
        grid.insert(scan(np.full(360, 3.05)), Pose2(1.0, 2.0, 0.3))
    for grid in (coarse, fine):
        rows, columns = np.nonzero(grid.occupancy > 0.5)
        at = grid.origin + grid.resolution * (np.stack([columns, rows], axis=1) + 0.5)
        np.testing.assert_allclose(np.hypot(*(at - (1.0, 2.0)).T), 3.05, atol=grid.resolution)
