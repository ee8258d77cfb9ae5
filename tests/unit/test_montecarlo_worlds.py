"""Worlds of Table 1: the known-map distances of the paper, and what is true in every one."""

import math

import numpy as np
import pytest

from robots.husky.spec import HUSKY
from sim.oracle import Oracle
from sim.scenes.model import World
from sim.scenes.object_relative import GOAL, LANDMARK, STOP_SHORT, layout_of
from sim.world import make_world

KNOWN_M = {
    "one_hydrant_one_cone": 8.75,
    "one_hydrant_two_cones": 11.18,
    "two_hydrants_one_cone": 10.44,
    "nearest_hydrant": 9.19,
}


def oracle(world: World) -> Oracle:
    return Oracle(world, HUSKY.base, lambda: world.world_from_start)


def straight_m(name: str, seed: int) -> float:
    layout, _ = layout_of(name, seed)
    return math.hypot(*layout.hydrants[0]) - STOP_SHORT


@pytest.mark.parametrize(("name", "known_m"), KNOWN_M.items())
def test_the_known_way_is_as_long_as_the_papers(name: str, known_m: float) -> None:
    lengths = [straight_m(name, seed) for seed in range(400)]
    standard_error = float(np.std(lengths)) / math.sqrt(len(lengths))
    assert np.mean(lengths) == pytest.approx(known_m, abs=0.15 + standard_error)


@pytest.mark.parametrize("name", KNOWN_M)
def test_a_detour_round_the_cone_adds_little(name: str) -> None:
    for seed in range(4):
        world = make_world(name, seed)
        shortest = oracle(world).shortest_path_length(GOAL, stop_at=STOP_SHORT)
        assert straight_m(name, seed) - 1e-6 <= shortest <= straight_m(name, seed) + 0.5


@pytest.mark.parametrize("name", list(KNOWN_M)[:3])
def test_only_the_goal_is_behind_a_cone(name: str) -> None:
    for seed in range(8):
        world = make_world(name, seed)
        cones = [placed.id for placed in world.objects if placed.label == "cone"]
        behind = {cone: oracle(world).satisfying("hydrant", "back", cone) for cone in cones}
        assert behind.pop(LANDMARK) == (GOAL,)
        assert set(behind.values()) <= {()}


def test_the_goal_is_the_hydrant_nearest_to_the_cone() -> None:
    for seed in range(8):
        world = make_world("nearest_hydrant", seed)
        assert oracle(world).nearest("hydrant", LANDMARK) == GOAL


@pytest.mark.parametrize("name", KNOWN_M)
def test_nothing_is_seen_three_metres_far_at_the_start(name: str) -> None:
    for seed in range(200):
        layout, _ = layout_of(name, seed)
        assert min(math.hypot(*point) for point in layout.hydrants + layout.cones) > 3.0


def test_the_same_seed_gives_the_same_world() -> None:
    assert make_world("nearest_hydrant", 3) == make_world("nearest_hydrant", 3)
    assert make_world("nearest_hydrant", 3) != make_world("nearest_hydrant", 4)
