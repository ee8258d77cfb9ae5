import numpy as np
import pytest

from schemas.belief import OccupancyGrid
from services.navigation.costmap import Room, costmap_of
from services.navigation.planner import NoPathError, is_blocked, plan

RADIUS = 0.65
ROOM = Room(RADIUS, RADIUS)


def grid_of(occupancy: np.ndarray, resolution: float = 0.1, origin=(-5.0, -5.0)) -> OccupancyGrid:
    return OccupancyGrid(
        stamp_ns=1,
        origin=origin,
        resolution=resolution,
        occupancy=occupancy.astype(np.int8),
        looked=np.zeros(occupancy.shape, np.int8),
    )


def walled_grid() -> OccupancyGrid:
    """20 m x 20 m, free, with a wall at x = 5 that leaves a gap at y in [4, 7]."""
    occupancy = np.full((200, 200), -20)
    occupancy[:90, 100:103] = 40
    occupancy[120:, 100:103] = 40
    return grid_of(occupancy)


def between(grid: OccupancyGrid, start, goal):
    start, goal = np.array(start, float), np.array(goal, float)
    costmap = costmap_of(grid, start, goal, ROOM)
    return costmap, plan(costmap, start, goal)


def test_open_ground_gives_the_straight_line():
    _, path = between(grid_of(np.full((200, 200), -20)), (0, 0), (7.0, 3.0))
    length = np.hypot(*np.diff(path.points, axis=0).T).sum()
    assert length == pytest.approx(np.hypot(7, 3), rel=0.01)
    assert path.points[-1] == pytest.approx([7.0, 3.0])


def test_path_goes_through_the_gap_and_keeps_clear():
    grid = walled_grid()
    _, path = between(grid, (0, 0), (10, 0))
    wall = np.argwhere(grid.occupancy > 0)[:, ::-1] * 0.1 + 0.05 - 5.0
    clearance = np.hypot(*(path.points[:, None] - wall[None]).transpose(2, 0, 1)).min()
    assert clearance > RADIUS - 0.1
    assert path.points[-1] == pytest.approx([10, 0])


def test_cost_grows_with_the_way_and_with_obstacles():
    free = grid_of(np.full((200, 200), -20))
    costs = [between(free, (0, 0), (x, 0))[1].cost for x in (2.0, 4.0, 6.0, 8.0)]
    assert costs == sorted(costs)
    assert between(walled_grid(), (0, 0), (8, 0))[1].cost > costs[-1]


def test_unknown_ground_is_passable_but_dearer():
    known = between(grid_of(np.full((200, 200), -20)), (0, 0), (8, 0))[1]
    unknown = between(grid_of(np.zeros((200, 200))), (0, 0), (8, 0))[1]
    assert unknown.points[-1] == pytest.approx([8, 0])
    assert unknown.cost > known.cost


def test_goal_outside_the_grid_is_unknown_ground():
    _, path = between(grid_of(np.full((40, 40), -20), origin=(-2.0, -2.0)), (0, 0), (12, 0))
    assert path.points[-1] == pytest.approx([12, 0])


def test_goal_in_an_obstacle_moves_to_the_nearest_free_place():
    occupancy = np.full((200, 200), -20)
    occupancy[48:53, 118:123] = 40  # Half a metre square at (7, 0).
    _, path = between(grid_of(occupancy), (0, 0), (7, 0))
    assert 0.6 < np.hypot(*(path.points[-1] - [7, 0])) <= 1.0


def test_goal_inside_a_wide_obstacle_is_refused():
    occupancy = np.full((200, 200), -20)
    occupancy[20:80, 90:150] = 40
    with pytest.raises(NoPathError, match="allowed are"):
        between(grid_of(occupancy), (0, 0), (7, 0))


def test_base_too_near_an_obstacle_may_drive_out():
    occupancy = np.full((200, 200), -20)
    occupancy[45:55, 55] = 40  # 0.5 m ahead.
    _, path = between(grid_of(occupancy), (0, 0), (-3, 0))
    assert path.points[-1] == pytest.approx([-3, 0])


def test_new_obstacle_blocks_an_old_path():
    costmap, path = between(grid_of(np.full((200, 200), -20)), (0, 0), (10, 0))
    assert not is_blocked(costmap, path.points)
    costmap = costmap_of(walled_grid(), np.zeros(2), np.array([10.0, 0]), ROOM)
    assert is_blocked(costmap, path.points)


@pytest.mark.parametrize("y", np.linspace(0.6, 1.0, 9))
def test_a_goal_too_near_an_obstacle_is_no_licence_to_cut_through_it(y: float):
    occupancy = np.full((200, 200), -20)
    occupancy[48:53, 98:103] = 40  # Half a metre square at (5, 0).
    costmap, path = between(grid_of(occupancy), (0, 0), (5.6, y))
    assert np.isfinite(costmap.cost_along(path.points[:-1])).all()
    assert np.hypot(*(path.points - [5.05, 0.05]).T).min() > RADIUS
