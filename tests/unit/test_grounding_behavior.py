"""Behaviour inference in map hypotheses: geometry, and laws of the distribution."""

import math
import time

import numpy as np
import pytest

from services.grounding.errors import GroundingError
from services.grounding.model import MAX_BEHAVIORS, BehaviorDistribution, GroundingModel
from services.grounding.spatial import DENSITY, FAMILIES, Placement, truth, typical_offset
from services.grounding.world import WorldObjects

MODEL = GroundingModel.load("husky")


def world(*objects: tuple[str, float, float], viewer: tuple[float, float, float] = (0, 0, 0)):
    count = len(objects)
    return WorldObjects(
        classes=np.array([MODEL.names.index(name) for name, _, _ in objects], dtype=np.int64),
        positions=np.array([[x, y, 0.0] for _, x, y in objects]).reshape(count, 3),
        extents=np.full((count, 3), 0.5),
        observed=np.ones(count, dtype=np.bool_),
        viewer=np.array(viewer, dtype=np.float64),
    )


def random_world(rng: np.random.Generator, count: int) -> WorldObjects:
    names = rng.choice(["cone", "hydrant", "tree"], count)
    places = rng.uniform(-8, 8, (count, 2))
    found = world(*((str(n), *xy) for n, xy in zip(names, places.tolist(), strict=True)))
    found.observed[:] = rng.uniform(size=count) < 0.5
    return found


def infer(text: str, where: WorldObjects) -> BehaviorDistribution:
    return MODEL.behaviors(MODEL.understand(text), where)


@pytest.mark.parametrize(
    ("relation", "place"),
    [
        ("behind", (7, 0)),
        ("in front of", (3, 0)),
        ("to the left of", (5, 2)),
        ("to the right of", (5, -2)),
        ("near", (5, 1.5)),
        ("far from", (5, 9)),
    ],
)
def test_relation_picks_the_hydrant_at_its_place(relation: str, place: tuple[float, float]) -> None:
    others = {(7, 0), (3, 0), (5, 2), (5, -2), (5, 9)} - {place}
    if relation == "near":
        others = {(5, 9), (-6, 0)}
    where = world(("cone", 5, 0), ("hydrant", *place), *(("hydrant", *xy) for xy in others))
    best = infer(f"go to the hydrant {relation} the cone", where).behaviors[0]
    assert (best.object_index, best.landmark_index) == (1, 0)


def test_behind_is_seen_from_the_viewer() -> None:
    objects = (("cone", 5.0, 0.0), ("hydrant", 7.0, 0.0), ("hydrant", 3.0, 0.0))
    text = "go to the hydrant behind the cone"
    assert infer(text, world(*objects)).behaviors[0].object_index == 1
    from_beyond = world(*objects, viewer=(10.0, 0.0, math.pi))
    assert infer(text, from_beyond).behaviors[0].object_index == 2


def test_nearest_is_about_rank_not_distance() -> None:
    where = world(("cone", 0, 5), ("hydrant", 9, 5), ("hydrant", 12, 5))
    best = infer("go to the hydrant nearest to the cone", where).behaviors[0]
    assert best.object_index == 1
    assert best.probability > 0.6


def test_closest_without_landmark_means_the_robot() -> None:
    where = world(("cone", 6, 0), ("cone", 2, 2), viewer=(0, 0, 0))
    assert infer("head over to the closest cone", where).behaviors[0].object_index == 1


def test_left_without_landmark_is_the_robots_left() -> None:
    where = world(("cone", 0, -4), ("cone", 0, 4), viewer=(0, 0, math.pi))
    assert infer("go to the cone on the left", where).behaviors[0].object_index == 0


def test_place_for_the_robot_has_only_a_landmark() -> None:
    best = infer("go behind the car", world(("car", 5, 0))).behaviors[0]
    assert (best.object, best.object_index) == ("robot", -1)
    assert (best.relation, best.landmark_index) == ("back", 0)


def test_nothing_fits_keeps_its_mass() -> None:
    text = "go to the hydrant behind the cone"
    fitting = infer(text, world(("cone", 5, 0), ("hydrant", 7, 0)))
    elsewhere = infer(text, world(("cone", 5, 0), ("hydrant", -6, 3)))
    missing = infer(text, world(("cone", 5, 0)))
    empty = infer(text, world())
    assert fitting.nothing_fits < 0.2
    assert elsewhere.nothing_fits > 0.5
    assert missing.nothing_fits == pytest.approx(empty.nothing_fits)
    assert missing.nothing_fits > 0.95
    assert not missing.behaviors


@pytest.mark.parametrize("seed", range(5))
def test_masses_sum_to_one(seed: int) -> None:
    where = random_world(np.random.default_rng(seed), 12)
    for text in ("go to the hydrant behind the cone", "there is a cone", "paint the fence"):
        found = infer(text, where)
        total = math.fsum(one.probability for one in found.behaviors)
        assert total + found.nothing_fits + found.statement_mass + found.other_mass == (
            pytest.approx(1.0)
        )


@pytest.mark.parametrize("text", ["go to the hydrant behind the cone", "go to the nearest tree"])
def test_order_of_objects_does_not_matter(text: str) -> None:
    rng = np.random.default_rng(5)
    where = random_world(rng, 15)
    order = rng.permutation(15)
    shuffled = WorldObjects(
        where.classes[order],
        where.positions[order],
        where.extents[order],
        where.observed[order],
        where.viewer,
    )
    found, other = infer(text, where), infer(text, shuffled)
    place = [*order.tolist(), -1]
    relabelled = {
        (place[one.object_index], place[one.landmark_index]): one.probability
        for one in other.behaviors
    }
    original = {(one.object_index, one.landmark_index): one.probability for one in found.behaviors}
    assert relabelled == pytest.approx(original)
    assert other.nothing_fits == pytest.approx(found.nothing_fits)


@pytest.mark.parametrize("text", ["go to the hydrant behind the cone", "go to the nearest tree"])
def test_more_particles_do_not_change_a_particles_answer(text: str) -> None:
    rng = np.random.default_rng(6)
    worlds = [random_world(rng, int(rng.integers(0, 10))) for _ in range(8)]
    understanding = MODEL.understand(text)
    together = MODEL.behaviors_in_belief(understanding, worlds)
    for where, found in zip(worlds, together, strict=True):
        alone = MODEL.behaviors(understanding, where)
        assert found.nothing_fits == pytest.approx(alone.nothing_fits)
        assert [(b.object_index, b.landmark_index) for b in found.behaviors] == [
            (b.object_index, b.landmark_index) for b in alone.behaviors
        ]
        assert [b.probability for b in found.behaviors] == pytest.approx(
            [b.probability for b in alone.behaviors]
        )


def test_without_a_map_the_annotation_itself_is_the_map() -> None:
    for text in ("go to the hydrant behind the cone near the tree", "go to the cone on the left"):
        found = MODEL.behaviors(MODEL.understand(text))
        assert found.behaviors[0].probability > 0.8


def test_wrong_shapes_name_what_is_allowed() -> None:
    with pytest.raises(GroundingError, match="allowed"):
        WorldObjects(
            np.zeros(2, dtype=np.int64),
            np.zeros((2, 2)),
            np.zeros((2, 3)),
            np.ones(2, dtype=np.bool_),
            np.zeros(3),
        )


def placement(u: float, v: float) -> Placement:
    one = np.ones(1)
    return Placement(
        along=u * one,
        across=v * one,
        touch=0.5 * one,
        of_robot=False,
        sight=5.0 * one,
        axis_along=u * one,
        axis_across=v * one,
        margin=0.25 - max(abs(u), abs(v)) * one,
        area=0.25 * one,
    )


@pytest.mark.parametrize("relation", DENSITY)
def test_typical_place_is_true_for_the_relation(relation: str) -> None:
    u, v = typical_offset(relation, False)
    assert truth(relation, placement(u, v))[0] > 0.8


def test_opposite_directions_exclude_one_another() -> None:
    directions = set(FAMILIES[0]) - {"behind"}
    for u, v in ((3.0, 1.0), (-2.0, 0.5), (0.0, -2.0), (9.0, 9.0)):
        degrees = [truth(name, placement(u, v))[0] for name in directions]
        assert all(0.0 <= degree <= 1.0 for degree in degrees)
        assert sum(degrees) <= 1.0 + 1e-9


@pytest.mark.parametrize(("degrees", "relation"), [(0, "back"), (50, "back"), (70, "left")])
def test_sides_are_the_sectors_that_evaluation_uses(degrees: float, relation: str) -> None:
    u, v = 3.0 * math.cos(math.radians(degrees)), 3.0 * math.sin(math.radians(degrees))
    assert truth(relation, placement(u, v))[0] > 0.7


def test_behind_the_robot_is_behind_its_back() -> None:
    where = world(("cone", -4, 0), ("cone", 4, 0))
    assert infer("go to the cone in front of you", where).behaviors[0].object_index == 1
    assert infer("go to the cone behind you", where).behaviors[0].object_index == 0


def test_superlatives_rank_by_their_own_measure() -> None:
    where = world(("cone", 5, 3), ("cone", 5, -1), ("cone", 6, 9))
    assert infer("go to the leftmost cone", where).behaviors[0].object_index == 2
    assert infer("go to the rightmost cone", where).behaviors[0].object_index == 1
    assert infer("go to the nearest cone", where).behaviors[0].object_index == 1


def test_inside_and_down_use_the_box_of_the_place() -> None:
    model = GroundingModel.load("husky_ur5")
    extents = np.array([[6.0, 6.0, 3.0], [0.2, 0.2, 0.2], [0.2, 0.2, 0.2]])
    where = WorldObjects(
        classes=np.array([model.names.index(name) for name in ("lab", "ball", "ball")]),
        positions=np.array([[8.0, 0.0, 0.0], [10.5, 2.5, 0.0], [2.0, 0.0, 0.0]]),
        extents=extents,
        observed=np.ones(3, dtype=np.bool_),
        viewer=np.zeros(3),
    )
    best = model.behaviors(model.understand("retrieve the ball in the lab"), where).behaviors[0]
    assert (best.object_index, best.landmark_index) == (1, 0)


@pytest.mark.parametrize(("count", "limit_s"), [(24, 0.02), (200, 0.1)])
def test_one_particle_is_fast_and_lists_no_more_than_needed(count: int, limit_s: float) -> None:
    where = random_world(np.random.default_rng(9), count)
    understanding = MODEL.understand("go to the hydrant behind the cone")
    MODEL.behaviors(understanding, where)
    started = time.perf_counter()
    found = MODEL.behaviors(understanding, where)
    assert time.perf_counter() - started < limit_s
    assert len(found.behaviors) <= MAX_BEHAVIORS * len(understanding.intents)
