"""Office floors: plans that turn without changing, doors that a chair fits through, solid walls."""

import math

import numpy as np
import pytest
import shapely

from robots.wheelchair.spec import WHEELCHAIR
from schemas.geometry import Pose2
from sim.driver import SapienDriver
from sim.oracle import Oracle, outline_of_region, outline_of_wall, shortest_path
from sim.scenes.model import WorldError, load_world, save_world
from sim.scenes.office import GOAL
from sim.world import make_world

NAMES = ("office", "office_turned", "office_long")


def oracle(world, pose=None):
    return Oracle(world, WHEELCHAIR.base, lambda: pose or world.world_from_start)


def walls_of(world):
    return [outline_of_wall(wall) for wall in world.walls]


@pytest.mark.parametrize("name", NAMES)
def test_the_way_with_a_known_map_is_the_papers_in_every_plan(name):
    comfortable = WHEELCHAIR.base.passage_radius + 0.23
    lengths = [
        shortest_path((0, 0), world.region(GOAL).center, walls_of(world), comfortable)
        for world in (make_world(name, seed) for seed in range(6))
    ]
    assert 12.7 < np.mean(lengths) < 12.95
    assert np.ptp(lengths) < 1e-6


def test_seeds_turn_and_mirror_the_plan():
    goals = {make_world("office", seed).region(GOAL).center for seed in range(60)}
    assert len(goals) == 8
    headings = [make_world("office", seed).world_from_start.yaw for seed in range(60)]
    assert len(set(headings)) == 60


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(3))
def test_every_place_can_be_driven_to_and_none_has_a_wall_in_it(name, seed):
    world = make_world(name, seed)
    walls = shapely.union_all(walls_of(world))
    for region in world.regions:
        assert outline_of_region(region).intersection(walls).area < 1e-6
        assert shapely.Polygon(region.corners).exterior.is_ccw
        wide = WHEELCHAIR.base.passage_radius + 0.25
        assert math.isfinite(shortest_path((0, 0), region.center, walls_of(world), wide))


@pytest.mark.parametrize("name", NAMES)
def test_there_is_no_way_out_but_through_doors(name):
    world = make_world(name, 0)
    far = (200.0, 0.0)
    assert math.isinf(shortest_path((0, 0), far, [shapely.union_all(walls_of(world))], 0.05))


def test_both_doors_of_the_lab_are_equally_far():
    world = make_world("office", 0)
    to_halls = [
        shortest_path((0, 0), region.center, walls_of(world), 0.4)
        - shortest_path(_mouth(region), region.center, walls_of(world), 0.4)
        for region in world.regions
        if region.kind == "hallway"
    ]
    assert to_halls[0] == pytest.approx(to_halls[1], abs=0.3)


def _mouth(hall):
    corners = np.array(hall.corners)
    ends = corners[np.argsort(np.hypot(*corners.T))[:2]]
    return tuple(ends.mean(axis=0))


def test_the_kitchen_adjoins_the_right_hallway_alone():
    truth = oracle(make_world("office", 3))
    assert truth.adjoining("kitchen", "hallway_1") == (GOAL,)
    assert truth.adjoining("kitchen", "hallway_2") == ()
    assert truth.adjoining("office", "hallway_2") == ("office_3",)


def test_being_in_a_place_means_inside_or_at_its_middle():
    world = make_world("office", 3)
    x, y = world.region(GOAL).center
    corner_x, corner_y = world.region(GOAL).corners[0]
    near_corner = Pose2(x + 0.9 * (corner_x - x), y + 0.9 * (corner_y - y), 0.0)
    assert oracle(world, Pose2(x, y, 0.0)).is_at(GOAL, 0.0)
    assert oracle(world, near_corner).is_at(GOAL, 0.0)
    assert not oracle(world).is_at(GOAL, 0.0)


def test_walls_are_seen_by_the_laser_and_counted_as_obstacles():
    world = make_world("office", 1)
    driver = SapienDriver(WHEELCHAIR, world, 1, camera=False)
    scan = next(r for r in driver.step(200_000_000) if hasattr(r, "ranges"))
    walls = shapely.union_all(walls_of(world))
    angles = world.world_from_start.yaw + scan.angle_min
    angles = angles + scan.angle_increment * np.arange(len(scan.ranges))
    rays = [shapely.LineString([(0, 0), (8 * math.cos(a), 8 * math.sin(a))]) for a in angles]
    expected = np.array([walls.intersection(ray).distance(shapely.Point(0, 0)) for ray in rays])
    hit = np.array([walls.intersects(ray) for ray in rays])
    answered = np.isfinite(scan.ranges)
    assert np.mean(hit == answered) > 0.98
    both = hit & answered
    assert np.median(np.abs(scan.ranges[both] - expected[both])) < 0.02
    driver.close()
    # The lab begins 2.3 m behind the start.
    assert oracle(world).clearance() == pytest.approx(2.3 - 0.55, abs=0.25)


def test_a_world_with_walls_is_read_back_unchanged(tmp_path):
    world, path = make_world("office_long", 1), tmp_path / "mine.json"
    save_world(world, path)
    assert load_world(path) == world
    assert make_world(str(path), 99) == world
    with pytest.raises(WorldError, match=r"'attic'.*kitchen_1"):
        world.region("attic")


def test_worlds_without_walls_are_written_as_before(tmp_path):
    path = tmp_path / "outdoors.json"
    save_world(make_world("hydrant", 0), path)
    assert "walls" not in path.read_text()
    assert "regions" not in path.read_text()
