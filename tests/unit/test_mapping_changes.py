"""A world that does not stand still: things are taken away, moved, or come to be."""

import numpy as np
import pytest

from schemas.belief import MapBelief
from schemas.topics import Output
from services.mapping.node import MappingNode
from tests.unit.test_mapping_episode import (
    BEHIND,
    World,
    assert_grounded,
    corridor_mass,
    drive,
    last_belief,
    make_node,
    mass_on,
    says,
)

pytestmark = pytest.mark.usefixtures("without_learning")

BEFORE_THE_CONE = (1.5, 0.5)


def watch(node: MappingNode, world: World, frames: int) -> list[Output]:
    """Stand where the robot is and look ahead."""
    ahead = world.true.apply(np.array([0.01, 0.0]))
    return [o for _ in range(frames) for o in world.step((ahead[0], ahead[1]), node)]


def places_of(belief: MapBelief, name: str) -> np.ndarray:
    rows = belief.seen & (belief.class_index == belief.classes.index(name))
    return belief.position[rows]


@pytest.mark.parametrize("seed", range(3))
def test_what_is_taken_away_is_forgotten_and_hypotheses_move_on(seed: int) -> None:
    world, node = World([("hydrant", 5.0, 0.0)], np.random.default_rng(seed)), make_node(seed)
    node.on_annotations(says("hydrant"))
    there = last_belief(drive(node, world, [BEFORE_THE_CONE]))
    assert mass_on(there, 5.0, 0.0) > 0.5
    world.objects.clear()
    outputs = watch(node, world, 40)
    for output in outputs:
        assert isinstance(output.message, MapBelief)
        assert_grounded(output.message)
        assert output.message.weights.sum() == pytest.approx(1.0)
    gone = last_belief(outputs)
    assert not len(places_of(gone, "hydrant"))
    assert (gone.figure == 1000).all()
    assert corridor_mass(gone) < 0.3


@pytest.mark.parametrize("seed", range(3))
def test_what_was_moved_is_found_again_and_the_old_place_dies(seed: int) -> None:
    things = [("cone", 4.0, 1.0), ("hydrant", 5.0, 0.0)]
    world, node = World(things, np.random.default_rng(seed)), make_node(seed)
    node.on_annotations(says("hydrant"))
    assert mass_on(last_belief(drive(node, world, [BEFORE_THE_CONE])), 5.0, 0.0) > 0.5
    world.objects[1] = ("hydrant", 4.5, 2.4)
    moved = last_belief(watch(node, world, 40))
    assert mass_on(moved, 5.0, 0.0) == 0.0
    assert mass_on(moved, 4.5, 2.4) > 0.7
    np.testing.assert_allclose(places_of(moved, "hydrant"), [[4.5, 2.4]], atol=0.3)
    np.testing.assert_allclose(places_of(moved, "cone"), [[4.0, 1.0]], atol=0.3)


def test_a_landmark_that_was_taken_away_grounds_nothing() -> None:
    world, node = World([("cone", 5.0, 0.5), ("hydrant", 5.0, -2.5)]), make_node()
    node.on_annotations(BEHIND)
    drive(node, world, [BEFORE_THE_CONE])
    del world.objects[0]
    belief = last_belief(watch(node, world, 40))
    assert not len(places_of(belief, "cone"))
    assert_grounded(belief)
    assert (belief.landmark == 1001).all()


def test_what_comes_to_be_is_taken_for_what_was_meant() -> None:
    world, node = World([], false_rate=0.0), make_node()
    node.on_annotations(says("hydrant"))
    drive(node, world, [BEFORE_THE_CONE])
    world.objects.append(("hydrant", 5.0, 0.5))
    assert mass_on(last_belief(watch(node, world, 15)), 5.0, 0.5) > 0.8


def test_what_was_seen_for_one_instruction_serves_the_next_at_once() -> None:
    world, node = World([("cone", 4.0, 1.0), ("hydrant", 6.0, -0.5)]), make_node()
    node.on_annotations(says("hydrant", id="i1"))
    first = last_belief(drive(node, world, [BEFORE_THE_CONE]))
    (second,) = node.on_annotations(says("cone", id="i2"))
    assert isinstance(second.message, MapBelief)
    assert second.message.instruction_id == "i2"
    assert mass_on(second.message, 4.0, 1.0) > 0.5
    np.testing.assert_array_equal(second.message.trajectory, first.trajectory)
    np.testing.assert_array_equal(places_of(second.message, "hydrant"), places_of(first, "hydrant"))


def test_what_was_looked_at_for_one_instruction_is_not_imagined_in_the_next() -> None:
    world, node = World([], false_rate=0.0), make_node()
    fresh = last_belief(node.on_annotations(says("hydrant", id="i1")))
    drive(node, world, [(6.0, 0.0)])
    later = last_belief(node.on_annotations(says("hydrant", id="i2")))
    in_view = [
        np.abs(b.position[b.node == 1000] - (4.0, 0.0)).max(axis=1) < 1.0 for b in (fresh, later)
    ]
    assert in_view[1].sum() < 0.5 * max(in_view[0].sum(), 1)
