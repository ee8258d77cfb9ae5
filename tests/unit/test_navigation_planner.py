import numpy as np
import pytest

from robots.wheelchair.spec import WHEELCHAIR
from schemas.belief import OccupancyGrid
from schemas.geometry import Pose2
from schemas.task import Goal
from services.navigation.costmap import Room, costmap_of
from services.navigation.planner import NoPathError, is_blocked, plan
from services.navigation.route import Route
from tests.unit.test_policy_places import doorway

RADIUS = 0.65
ROOM = Room(RADIUS, RADIUS)
CHAIR = Room.of(WHEELCHAIR.base)


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


@pytest.mark.parametrize("degrees", range(0, 180, 7))
def test_a_long_base_finds_its_way_through_a_door_at_any_angle_to_the_cells(degrees: int):
    across = 3.0 * np.array([-np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])
    grid = doorway(np.radians(degrees), WHEELCHAIR.laser.grid_resolution)
    path = plan(costmap_of(grid, -across, across, CHAIR), -across, across)
    assert path.points[-1] == pytest.approx(across, abs=0.01)
    assert np.hypot(*np.diff(path.points, axis=0).T).sum() < 6.5


def test_a_path_ends_where_a_long_base_can_turn():
    grid = walled_grid()
    start, goal = np.zeros(2), np.array([4.5, 0.0])
    costmap = costmap_of(grid, start, goal, CHAIR)
    end = plan(costmap, start, goal).points[-1]
    assert costmap.cramped[costmap.cell(goal)]
    assert not costmap.cramped[costmap.cell(end)]
    assert np.hypot(*(end - goal)) < 0.6


def test_a_base_that_turns_anywhere_is_never_cramped():
    assert not costmap_of(walled_grid(), np.zeros(2), np.array([4.5, 0.0]), ROOM).cramped.any()


def test_the_way_to_the_other_side_of_a_long_wall_is_found_in_all_that_was_measured():
    occupancy = np.full((400, 400), -20)
    occupancy[:3] = 40
    occupancy[:300, 100:103] = 40  # The only way leads round its end, 25 m away.
    grid, goal = grid_of(occupancy), Pose2(7.0, 0.0, 0.0)
    start, end = np.zeros(2), np.array([7.0, 0.0])
    with pytest.raises(NoPathError):
        plan(costmap_of(grid, start, end, ROOM), start, end)
    route = Route(
        Goal(stamp_ns=0, id="g", instruction_id="i", map_from_goal=goal, tolerance=0.15,
             face=True, speed_limit=1.0), ROOM)  # fmt: skip
    route.update(grid, Pose2(0.0, 0.0, 0.0), 0)
    assert route.path is not None
    assert route.path[-1] == pytest.approx(end)
