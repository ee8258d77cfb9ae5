import itertools
import math

import numpy as np
import pytest
import shapely

from robots.husky.spec import HUSKY
from sim.oracle import Oracle, OracleError, footprint, shortest_path
from sim.scenes.hydrant import hydrant_behind_cone
from sim.scenes.model import WorldError, load_world, save_world
from sim.world import make_world, world_names, world_summaries


def oracle(world):
    return Oracle(world, HUSKY.base, lambda: world.world_from_start)


@pytest.mark.parametrize("name", world_names())
def test_same_seed_same_world_and_another_seed_differs(name):
    assert make_world(name, 4) == make_world(name, 4)
    assert make_world(name, 4) != make_world(name, 5)
    assert name in world_summaries()


@pytest.mark.parametrize("name", world_names())
@pytest.mark.parametrize("seed", range(4))
def test_nothing_overlaps_and_the_start_is_free(name, seed):
    world = make_world(name, seed)
    # What lies in a box is where the box is.
    outlines = [footprint(placed) for placed in world.objects if placed.height == 0]
    for first, second in itertools.combinations(outlines, 2):
        assert first.distance(second) > 0.5
    assert oracle(world).clearance() > 1.0
    assert len({placed.id for placed in world.objects}) == len(world.objects)


@pytest.mark.parametrize("seed", range(8))
def test_the_hydrant_is_behind_the_cone_and_can_be_reached(seed):
    truth = oracle(make_world("hydrant", seed))
    assert truth.satisfying("hydrant", "back", "cone_1") == ("hydrant_1",)
    straight = truth.distance_to("hydrant_1")
    assert 0 <= truth.shortest_path_length("hydrant_1", stop_at=0.0) - straight < 4


@pytest.mark.parametrize("seed", range(8))
def test_only_one_of_two_hydrants_is_behind_the_cone(seed):
    truth = oracle(make_world("two_hydrants", seed))
    assert truth.satisfying("hydrant", "back", "cone_1") == ("hydrant_1",)
    assert len(truth.satisfying("hydrant", "unknown", "cone_1")) == 2


def test_goal_distances_follow_the_published_distribution():
    rng = np.random.default_rng(0)
    goals = np.array([hydrant_behind_cone(rng, 9.25, 1.69)[1] for _ in range(500)])
    assert np.hypot(*goals.T).mean() == pytest.approx(9.25, abs=0.25)
    assert np.hypot(*goals.T).std() == pytest.approx(1.69, abs=0.25)
    assert np.abs(np.arctan2(goals[:, 1], goals[:, 0])).max() <= math.radians(50)


def test_a_saved_world_is_read_back_unchanged(tmp_path):
    world, path = make_world("hydrant", 1), tmp_path / "mine.json"
    save_world(world, path)
    assert load_world(path) == world
    assert make_world(str(path), 99) == world


def test_bad_names_and_files_are_answered_with_what_is_valid(tmp_path):
    with pytest.raises(WorldError, match=r"'moon'.*hydrant, two_hydrants"):
        make_world("moon", 0)
    broken = tmp_path / "broken.json"
    broken.write_text('{"name": 3}')
    with pytest.raises(WorldError, match=r"broken\.json.*name"):
        make_world(str(broken), 0)
    with pytest.raises(WorldError, match=r"'cow'.*cone_1"):
        make_world("hydrant", 0).find("cow")


def test_the_sides_of_a_landmark_do_not_overlap():
    world = make_world("hydrant", 2)
    truth = oracle(world)
    labels = {placed.label for placed in world.objects}
    for label in labels:
        sides = [
            truth.satisfying(label, side, "cone_1") for side in ("front", "back", "left", "right")
        ]
        every = list(itertools.chain(*sides))
        assert sorted(every) == sorted(truth.satisfying(label, "unknown", "cone_1"))


def test_the_shortest_path_goes_around_and_says_when_there_is_none():
    wall = shapely.box(4, -3, 5, 3)
    # Tangent to the circle around each corner, a piece of that circle, and the wall's width.
    tangent = math.sqrt(4**2 + 3**2 - 0.5**2)
    turn = math.atan2(3, 4) + math.asin(0.5 / 5)
    expected = 2 * (tangent + 0.5 * turn) + 1
    assert shortest_path((0, 0), (9, 0), [wall], 0.5) == pytest.approx(expected, abs=0.05)
    assert shortest_path((0, 0), (10, 0), [], 0.5) == pytest.approx(10)
    ring = shapely.Point(10, 0).buffer(3).boundary.buffer(0.1)
    assert math.isinf(shortest_path((0, 0), (10, 0), [ring], 0.5))
    with pytest.raises(OracleError, match="above"):
        oracle(make_world("hydrant", 0)).satisfying("cone", "above", "hydrant_1")


def test_nearest_is_the_smallest_distance():
    world = make_world("hydrant", 3)
    best = oracle(world).nearest("barrel", "cone_1")
    cone = world.find("cone_1").world_from_object
    poses = {p.id: p.world_from_object for p in world.objects if p.label == "barrel"}
    distance = {id_: math.hypot(pose.x - cone.x, pose.y - cone.y) for id_, pose in poses.items()}
    assert best == min(distance, key=distance.__getitem__)
