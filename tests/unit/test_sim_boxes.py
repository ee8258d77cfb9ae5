"""Worlds with boxes: who holds what, what is in sight at first, and what can be reached."""

import math

import numpy as np
import pytest

from robots.husky_ur5.spec import HUSKY_UR5
from sim.assets.library import bounds
from sim.oracle import Oracle
from sim.scenes.boxes import INDOORS, OTHER, OUTDOORS, WANTED, WIDEST
from sim.scenes.model import PlacedObject, World
from sim.world import make_world

SITES = {"indoor": INDOORS, "outdoor": OUTDOORS}


def distance(placed: PlacedObject) -> float:
    return math.hypot(placed.world_from_object.x, placed.world_from_object.y)


def content(world: World) -> dict[str, PlacedObject]:
    """The box of each small thing, by the thing's class."""
    boxes = [one for one in world.objects if one.label == "box"]
    found = {}
    for thing in world.objects:
        if thing.height > 0:
            at = np.array([thing.world_from_object.x, thing.world_from_object.y])
            (found[thing.label],) = [box for box in boxes if is_in(box, thing, at)]
    return found


def is_in(box: PlacedObject, thing: PlacedObject, at: np.ndarray) -> bool:
    local = box.world_from_object.inverse().apply(at)
    return bool((np.abs(local) < bounds("box", box.look)[1][:2]).all())


@pytest.mark.parametrize("kind", SITES)
@pytest.mark.parametrize("seed", range(8))
def test_the_near_box_holds_the_crackers_and_the_far_one_the_ball(kind: str, seed: int) -> None:
    world, site = make_world(f"box_{kind}", seed), SITES[kind]
    held = content(world)
    assert set(held) == {WANTED, OTHER}
    assert distance(held[OTHER]) < site.horizon < distance(held[WANTED])
    at = held[OTHER].world_from_object
    assert abs(math.atan2(at.y, at.x)) < HUSKY_UR5.camera.horizontal_fov / 2


@pytest.mark.parametrize("kind", SITES)
def test_random_worlds_have_one_to_five_boxes_and_one_ball(kind: str) -> None:
    worlds = [make_world(f"boxes_{kind}", seed) for seed in range(25)]
    counts = [sum(one.label == "box" for one in world.objects) for world in worlds]
    assert set(counts) == {1, 2, 3, 4, 5}
    for world in worlds:
        held = content(world)
        assert WANTED in held
        assert len({box.id for box in held.values()}) == len(held)
    assert any(len(content(w)) < n for w, n in zip(worlds, counts, strict=True))


@pytest.mark.parametrize("name", ["box_indoor", "box_outdoor", "boxes_indoor", "boxes_outdoor"])
@pytest.mark.parametrize("seed", range(5))
def test_things_are_small_enough_and_the_ball_has_room_for_fingers(name: str, seed: int) -> None:
    world = make_world(name, seed)
    for thing in (one for one in world.objects if one.height > 0):
        low, high = bounds(thing.label, thing.look)
        assert (high - low)[:2].min() <= WIDEST
    ball = world.find("ball_1")
    box, radius = content(world)[WANTED], bounds(WANTED, ball.look)[1][0]
    at = box.world_from_object.inverse() @ ball.world_from_object
    room = bounds("box", box.look)[1][:2] - radius - np.abs([at.x, at.y])
    assert room.min() > 0.03


@pytest.mark.parametrize("name", ["box_indoor", "boxes_indoor", "boxes_outdoor"])
@pytest.mark.parametrize("seed", range(4))
def test_every_box_can_be_driven_to(name: str, seed: int) -> None:
    world = make_world(name, seed)
    oracle = Oracle(world, HUSKY_UR5.base, lambda: world.world_from_start)
    for box in (one for one in world.objects if one.label == "box"):
        assert oracle.shortest_path_length(box.id) < 2 * distance(box) + 2
