"""A picture is evidence against what it was searched for, and against nothing else."""

import msgspec
import numpy as np
import pytest

from schemas import topics
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from services.mapping.grid import Grid
from services.mapping.heed import sought_in
from services.mapping.node import MappingNode
from tests.unit.test_mapping_episode import (
    CLASSES,
    FRAME_NS,
    World,
    corridor_mass,
    last_belief,
    make_node,
    says,
)

pytestmark = pytest.mark.usefixtures("without_learning")


def existence_of(belief: MapBelief) -> np.ndarray:
    return belief.existence[belief.seen]


def stand(node: MappingNode, world: World, frames: int, unsought: tuple[str, ...]) -> MapBelief:
    """Pictures in which nothing is found, searched for all but some classes."""
    beliefs = []
    for _ in range(frames):
        world.time_ns += FRAME_NS
        node.on_odometry(world.odometry())
        empty = msgspec.structs.replace(world.look(), unsought=unsought)
        beliefs.append(last_belief(node.on_detections(empty)))
    return beliefs[-1]


def known_cone() -> tuple[MappingNode, World]:
    """A map with a cone at 3 m, which then vanishes from the world, not from the view."""
    world, node = World([("cone", 3.0, 0.0)], false_rate=0.0), make_node()
    node.on_annotations(says("hydrant", "back", "cone"))
    for _ in range(8):
        world.time_ns += FRAME_NS
        node.on_odometry(world.odometry())
        node.on_detections(world.look())
    world.objects = []
    return node, world


@pytest.mark.parametrize("unsought", [("cone",), ("cone", "hydrant"), CLASSES])
def test_passing_over_a_class_never_lowers_the_belief_that_one_is_there(unsought):
    node, world = known_cone()
    before = existence_of(stand(node, world, 1, unsought))
    after = existence_of(stand(node, world, 20, unsought))
    assert len(before) == 1
    np.testing.assert_array_equal(after, before)


def test_looking_for_it_and_for_others_does_lower_it():
    node, world = known_cone()
    before = existence_of(stand(node, world, 1, ()))[0]
    after = existence_of(stand(node, world, 5, ("barrel", "hydrant")))[0]
    assert after < before


def test_pictures_without_the_class_say_nothing_about_where_one_may_be():
    world, node = World([], false_rate=0.0), make_node()
    first = last_belief(node.on_annotations(says("hydrant")))
    passed_over = stand(node, world, 15, ("hydrant",))
    assert corridor_mass(passed_over) == pytest.approx(corridor_mass(first), abs=0.05)
    searched = stand(node, world, 15, ("barrel",))
    assert corridor_mass(searched) < 0.6 * corridor_mass(first)


def test_what_was_looked_for_others_alone_is_new_ground_for_the_next_instruction():
    world, node = World([], false_rate=0.0), make_node()
    node.on_annotations(says("hydrant"))
    stand(node, world, 10, ("cone",))
    looked = node._filter.grid.looked
    assert looked.min() < -1.0
    node.on_annotations(says("cone", id="i2"))
    assert node._filter.grid.looked.min() == 0.0


def test_what_was_looked_for_all_holds_for_the_next_instruction():
    world, node = World([], false_rate=0.0), make_node()
    node.on_annotations(says("hydrant"))
    stand(node, world, 10, ())
    before = node._filter.grid.looked.copy()
    node.on_annotations(says("cone", id="i2"))
    np.testing.assert_array_equal(node._filter.grid.looked, before)


def test_a_class_that_the_map_has_no_name_for_is_an_unknown_thing():
    seen = msgspec.structs.replace(World([]).look(), unsought=("drill",))
    assert sought_in(seen, ("unknown", "cone")).tolist() == [False, True]
    seen = msgspec.structs.replace(seen, unsought=())
    assert sought_in(seen, ("unknown", "cone")).all()


@pytest.mark.parametrize("for_all", [True, False])
def test_a_restored_grid_claims_no_more_than_was_looked_for(for_all):
    grid, here = Grid((0.0, 0.0)), Pose2(0.0, 0.0, 0.0)
    shape = grid.around(here, 3.0)[1].shape
    miss, floor = (np.full(shape, value, np.float32) for value in (-1.0, -5.0))
    grid.look(here, 3.0, miss, floor, for_all)
    message = grid.message(1)
    assert isinstance(message, OccupancyGrid)
    assert message.looked_for_all is for_all
    reborn = Grid((0.0, 0.0))
    reborn.restore(message)
    assert reborn.looked.min() == -1.0
    reborn.ask_anew()
    assert reborn.looked.min() == (-1.0 if for_all else 0.0)


def test_the_belief_is_published_all_the_same():
    node, world = known_cone()
    empty = msgspec.structs.replace(world.look(), unsought=CLASSES)
    world.time_ns += FRAME_NS
    empty = msgspec.structs.replace(empty, stamp_ns=world.time_ns)
    assert [o.topic for o in node.on_detections(empty)] == [topics.BELIEF]
