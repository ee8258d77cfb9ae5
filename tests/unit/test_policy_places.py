"""Places: openings lie between walls, a place is one figure, and one stops in its middle."""

import numpy as np
import pytest

from robots.wheelchair.spec import WHEELCHAIR
from schemas.belief import MapBelief, OccupancyGrid, first_topology
from schemas.geometry import Pose2
from services.policy import places
from services.policy.referents import from_figures, mass_of, seen_figures
from services.policy.terrain import terrain_for, terrain_of
from services.policy.travel import travel_from

RADIUS = WHEELCHAIR.base.passage_radius + 0.05
TURNING = WHEELCHAIR.base.radius + 0.15
HERE = Pose2(0.0, 0.0, 0.0)


def room(door=1.2):
    """A room of 6 m by 6 m around the origin with a door to the right; outside is unknown."""
    side, cells = 0.2, 100
    centers = (np.arange(cells) + 0.5) * side - 10.0
    x, y = np.meshgrid(centers, centers)
    inside = (np.abs(x) < 3) & (np.abs(y) < 3)
    doorway = (x > 0) & (x < 3.4) & (np.abs(y) < door / 2)
    wall = (np.abs(x) < 3.2) & (np.abs(y) < 3.2) & ~inside & ~doorway
    occupancy = np.where(wall, 50, np.where(inside | doorway, -50, 0)).astype(np.int8)
    return OccupancyGrid(
        stamp_ns=0, origin=(-10.0, -10.0), resolution=side, occupancy=occupancy,
        looked=np.where(inside, -50, 0).astype(np.int8),
    )  # fmt: skip


def test_the_only_opening_of_a_room_is_its_door():
    terrain = terrain_for(room(), RADIUS)
    found = places.openings(terrain, HERE, RADIUS, TURNING)
    assert len(found) == 1
    assert found.target[0, 0] > 3.2
    assert abs(found.target[0, 1]) < 1.0
    # The base goes no farther than where it can still turn round.
    assert terrain.clearance_at(found.pose[:, :2])[0] >= TURNING


def test_a_chair_passes_doors_that_coarse_blocks_close():
    beyond = np.array([[5.0, 0.0]])
    fine = travel_from(terrain_for(room(), RADIUS), np.zeros(2), RADIUS)
    coarse = travel_from(terrain_of(room()), np.zeros(2), WHEELCHAIR.base.radius)
    assert fine.to(beyond)[0] == pytest.approx(5.0, abs=0.5)
    assert np.isinf(coarse.to(beyond)[0])


def test_no_way_leads_through_a_gap_narrower_than_the_chair():
    closed = travel_from(terrain_for(room(door=0.5), RADIUS), np.zeros(2), RADIUS)
    assert np.isinf(closed.to(np.array([[5.0, 0.0]]))[0])


def test_unknown_ground_counts_as_ground_nobody_looked_at():
    terrain = terrain_for(room(), RADIUS)
    assert terrain.unlooked[~terrain.known & ~terrain.occupied].min() > 0
    assert terrain_of(room()).unlooked.max() < terrain.unlooked.sum()


def test_the_middle_of_a_place_is_where_the_base_can_turn():
    terrain = terrain_for(room(), RADIUS)
    middle = places.inside(np.array([2.8, 0.0]), 7, terrain, TURNING, HERE)
    assert terrain.clearance_at(middle.pose[:, :2])[0] >= TURNING
    assert middle.object_id.tolist() == [7]
    exact = places.inside(np.array([0.1, 0.1]), 7, terrain, TURNING, HERE)
    assert exact.pose[0, :2] == pytest.approx([0.1, 0.1], abs=0.15)


def kitchens(*regions):
    """A belief of one hypothesis a topology, each with a kitchen: (id, x), as its figure."""
    count = len(regions)
    return MapBelief(
        stamp_ns=5, instruction_id="i", classes=("hydrant", "kitchen"),
        weights=np.full(count, 1 / count),
        particle=first_topology - np.arange(count, dtype=np.int32),
        node=np.array([node for node, _ in regions], np.int32),
        class_index=np.ones(count, np.int32), class_probability=np.ones(count),
        position=np.array([(x, 0.0) for _, x in regions]),
        covariance=np.tile(0.1 * np.eye(2), (count, 1, 1)), extent=np.full((count, 3), 4.0),
        existence=np.full(count, 0.98), figure=np.array([node for node, _ in regions], np.int32),
        landmark=np.full(count, -1, np.int32),
        figure_class=np.full(count, -1, np.int32),
        landmark_class=np.full(count, -1, np.int32), topology=np.arange(count, dtype=np.int32),
        node_regions=np.array([[node] for node, _ in regions], np.int32),
        region_edges=np.zeros((0, 3), np.int32), viewer=HERE, map_from_odom=HERE,
        map_from_base=HERE, trajectory=np.zeros((1, 3)), effective_particles=float(count),
    )  # fmt: skip


def test_a_place_is_one_figure_however_hypotheses_divide_it():
    referents = from_figures(kitchens((2012, 5.0), (2013, 5.6), (2013, 5.4)))
    (one,) = seen_figures(referents)
    assert mass_of(referents, one) == pytest.approx(1.0)


def test_two_places_stay_two():
    referents = from_figures(kitchens((2012, 5.0), (2019, 9.0)))
    assert len(seen_figures(referents)) == 2
    assert mass_of(referents, 2012) == pytest.approx(0.5)


def doorway(angle: float, side: float = 0.1, width: float = 0.9) -> OccupancyGrid:
    """A wall through the origin at an angle to the cells [rad], with a door of `width` [m]."""
    centers = (np.arange(round(12 / side)) + 0.5) * side - 6.0
    x, y = np.meshgrid(centers, centers)
    along, across = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
    occupancy = np.full(x.shape, -50, np.int8)
    # A scan ends on the wall's faces: every cell that the wall touches is hit.
    reach = side * (abs(np.cos(angle)) + abs(np.sin(angle))) / 2
    occupancy[(np.abs(across) < 0.1 + reach) & (np.abs(along) > width / 2 - reach)] = 50
    return OccupancyGrid(
        stamp_ns=0, origin=(-6.0, -6.0), resolution=side, occupancy=occupancy,
        looked=np.zeros(occupancy.shape, np.int8),
    )  # fmt: skip


@pytest.mark.parametrize("degrees", range(0, 180, 7))
def test_a_way_leads_through_a_door_at_any_angle_to_the_cells(degrees: int):
    across = 3.0 * np.array([-np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])
    grid = doorway(np.radians(degrees), WHEELCHAIR.laser.grid_resolution)
    travel = travel_from(terrain_for(grid, RADIUS), -across, RADIUS)
    assert travel.to(across[None])[0] == pytest.approx(6.0, abs=0.7)


def test_the_way_to_what_lies_off_the_terrain_has_the_detour_to_the_edge_there():
    wall = room()
    wall.occupancy[:, 60:62] = 50
    terrain = terrain_for(wall, RADIUS)
    travel = travel_from(terrain, np.zeros(2), RADIUS)
    assert np.isinf(travel.to(np.array([[50.0, 0.0]]))[0])
    assert travel.to(np.array([[-50.0, 0.0]]))[0] >= 50.0


@pytest.mark.parametrize("distance", np.arange(1.0, 3.0, 0.17))
def test_no_ray_leaps_over_a_thin_wall(distance: float):
    grid = doorway(0.3, width=0.0)
    terrain = terrain_for(grid, RADIUS)
    across = np.array([[-np.sin(0.3), np.cos(0.3)]])
    assert not terrain.in_sight(-distance * across, 3.0 * across)[0]
    assert terrain.in_sight(-distance * across, -3.0 * across)[0]
