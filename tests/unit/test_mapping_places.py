"""What the filter makes of rooms and hallways, told by a synthetic building."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import msgspec
import numpy as np
import pytest

from robots.symbols import SYMBOL_SPACES
from schemas import topics
from schemas.belief import MapBelief, OccupancyGrid
from schemas.codec import decode, encode
from schemas.health import Fault
from schemas.run import RunConfig
from services.mapping.allocation import Topologies
from services.mapping.belief import belief_of
from services.mapping.filter import SemanticFilter
from services.mapping.grid import Grid
from services.mapping.layout import layout_of
from services.mapping.node import MappingNode
from services.mapping.restoration import restore
from tests.building import CLASSES, Building, means, room_hall_room

Way = tuple[tuple[float, float], ...]

TO_THE_HALL: Way = ((3.0, 2.6), (5.5, 3.0), (11.0, 3.0))
TO_THE_DOOR: Way = ((14.7, 3.0), (14.7, 3.2))
TO_THE_KITCHEN: Way = ((14.7, 6.8),)
BACK: Way = ((14.7, 3.0), (5.5, 3.0), (2.0, 2.0))


def belief_in(building: Building, semantic: SemanticFilter) -> MapBelief:
    return belief_of(semantic, building.time_ns, "i", building.odometry)


def started(seed: int = 0) -> tuple[Building, SemanticFilter]:
    building = room_hall_room()
    semantic = building.filter(seed=seed)
    semantic.hear((means("kitchen"),), building.odometry)
    building.sense(semantic)
    return building, semantic


@dataclass
class Tour:
    """Beliefs at the stations of one walk."""

    building: Building
    hall: MapBelief
    door: MapBelief
    kitchen: MapBelief
    grid: OccupancyGrid
    """In the kitchen."""
    back: MapBelief


@pytest.fixture(scope="module")
def tour() -> Tour:
    building, semantic = started()
    beliefs: list[MapBelief] = []
    grids: list[OccupancyGrid] = []
    for way in (TO_THE_HALL, TO_THE_DOOR, TO_THE_KITCHEN, BACK):
        building.walk(semantic, *way)
        beliefs.append(belief_in(building, semantic))
        grids.append(semantic.grid.message(building.time_ns))
    return Tour(building, *beliefs[:3], grids[2], beliefs[3])


def share(belief: MapBelief, holds: Callable[[int], bool]) -> float:
    """Weight of the hypotheses whose topology has a property."""
    return sum(w for w, k in zip(belief.weights, belief.topology.tolist(), strict=True) if holds(k))


def share_here(belief: MapBelief, kind: str) -> float:
    """Weight of the hypotheses in which the robot stands in a place of a type."""

    def is_here(topology: int) -> bool:
        here = belief.node == belief.node_regions[topology][-1]
        own = here & (belief.particle == -2 - topology)
        return {CLASSES[index] for index in belief.class_index[own]} == {kind}

    return share(belief, is_here)


def meant(belief: MapBelief) -> np.ndarray:
    """Rows (P,) of the figures."""
    return belief.row_of(np.arange(len(belief.weights), dtype=np.int32), belief.figure)


def test_a_room_and_a_hallway_are_told_apart_at_the_door_by_scans_alone() -> None:
    building = room_hall_room()
    semantic = building.filter()
    building.walk(semantic, *TO_THE_HALL, (17.0, 3.0), looks=False)
    belief = belief_in(building, semantic)
    x = belief.trajectory[:, 0] + building.start[0]

    def divided_at_the_door(topology: int) -> bool:
        first = belief.node_regions[topology] == 2000
        return not first.all() and 4.5 < x[first].max() < 8.0 and 4.5 < x[~first].min() < 8.0

    assert share(belief, divided_at_the_door) > 0.5


def test_labels_divide_places_as_soon_as_they_are_entered(tour: Tour) -> None:
    assert share_here(tour.hall, "hallway") > 0.6
    assert share_here(tour.kitchen, "kitchen") > 0.6


def test_a_hypothesised_kitchen_dies_where_a_hallway_or_a_lab_was_seen(tour: Tour) -> None:
    places = tour.hall.position[meant(tour.hall)]
    inside = [tour.building.room(place) for place in places]
    assert tour.hall.weights[np.isin(inside, ("hallway", "lab"))].sum() < 0.05
    assert tour.hall.weights[np.array(inside) == ""].sum() > 0.5


def test_a_seen_kitchen_is_what_is_meant(tour: Tour) -> None:
    rows = meant(tour.kitchen)
    seen = tour.kitchen.seen[rows]
    assert tour.kitchen.weights[seen].sum() > 0.7
    assert {CLASSES[index] for index in tour.kitchen.class_index[rows[seen]]} == {"kitchen"}
    middle = np.average(tour.kitchen.position[rows[seen]], axis=0)
    assert tour.building.room(middle) == "kitchen"


def test_a_kitchen_that_is_only_looked_into_is_known_already(tour: Tour) -> None:
    far = (tour.door.particle == -1) & (tour.door.node >= 3000)
    kitchens = far & (tour.door.class_index == CLASSES.index("kitchen"))
    assert [tour.building.room(place) for place in tour.door.position[kitchens]] == ["kitchen"]
    assert tour.door.weights[np.isin(tour.door.figure, tour.door.node[kitchens])].sum() > 0.5


def test_places_are_as_wide_as_they_are(tour: Tour) -> None:
    heaviest = int(np.argmax(np.bincount(tour.back.topology, tour.back.weights)))
    own = tour.back.particle == -2 - heaviest
    halls = tour.back.extent[own & (tour.back.class_index == CLASSES.index("hallway")), :2]
    np.testing.assert_allclose(halls.max(axis=0), [12.0, 2.4], atol=1.0)


def test_coming_back_makes_no_new_places(tour: Tour) -> None:
    def count(belief: MapBelief) -> float:
        regions = [len(np.unique(names)) for names in belief.node_regions]
        return float(np.bincount(belief.topology, belief.weights) @ regions)

    assert count(tour.back) < count(tour.kitchen) + 0.6
    assert share(tour.back, lambda k: bool(tour.back.node_regions[k][-1] == 2000)) > 0.8
    assert share_here(tour.back, "lab") > 0.8


def test_beliefs_are_normalised_and_survive_the_wire(tour: Tour) -> None:
    for belief in (tour.hall, tour.door, tour.kitchen, tour.back):
        assert belief.weights.sum() == pytest.approx(1.0)
        again = decode(encode(belief), MapBelief)
        np.testing.assert_array_equal(again.node_regions, belief.node_regions)
        assert belief.node_regions.shape == (belief.topology.max() + 1, len(belief.trajectory))
        for topology in range(len(belief.node_regions)):
            names = belief.node[belief.particle == -2 - topology]
            assert set(names.tolist()) == set(belief.node_regions[topology].tolist())
            edges = belief.region_edges[belief.region_edges[:, 0] == topology, 1:]
            assert set(edges.flatten().tolist()) <= set(names.tolist())


def test_a_restart_keeps_the_places(tour: Tour) -> None:
    building = room_hall_room()
    building.time_ns = tour.kitchen.stamp_ns
    heir = building.filter(seed=1)
    restore(heir, decode(encode(tour.kitchen), MapBelief))
    heir.grid.restore(tour.grid)
    building.pose = building.origin @ tour.kitchen.map_from_base
    heir.recall((means("kitchen"),))
    after = belief_in(building, heir)
    assert len(after.trajectory) == len(tour.kitchen.trajectory) + 1
    np.testing.assert_array_equal(after.node_regions[:, :-1], tour.kitchen.node_regions)
    np.testing.assert_array_equal(after.figure, tour.kitchen.figure)
    assert share_here(after, "kitchen") > 0.6
    building.walk(heir, *TO_THE_DOOR[:1], (9.0, 3.0))
    assert share_here(belief_in(building, heir), "hallway") > 0.6


def stepped(change: Callable[[SemanticFilter], None]) -> np.ndarray:
    """Weights after a walk, a change, and one more look without a new pose node."""
    building, semantic = started()
    building.walk(semantic, *TO_THE_HALL[:2], (7.9, 3.0))
    change(semantic)
    semantic.glance(building.scene())
    return belief_in(building, semantic).weights


def test_a_hypothesis_does_not_depend_on_who_shares_its_topology() -> None:
    def unshare(semantic: SemanticFilter) -> None:
        owner = semantic.particles.topology
        before = semantic.topologies
        counts = np.bincount(owner, minlength=len(before.members))
        semantic.topologies = Topologies(
            tuple(before.members[k] for k in owner), (before.log_prior - np.log(counts))[owner]
        )
        own = np.arange(len(owner), dtype=np.int32)
        semantic.particles = replace(semantic.particles, topology=own)

    shared, unshared = stepped(lambda _: None), stepped(unshare)
    assert np.ptp(shared) > 1e-6
    np.testing.assert_allclose(unshared, shared, atol=1e-9)


def test_names_of_topologies_mean_nothing() -> None:
    def rename(semantic: SemanticFilter) -> None:
        count = len(semantic.topologies.members)
        order = np.random.default_rng(0).permutation(count)
        members = tuple(semantic.topologies.members[k] for k in order)
        semantic.topologies = Topologies(members, semantic.topologies.log_prior[order])
        renamed = np.argsort(order)[semantic.particles.topology].astype(np.int32)
        semantic.particles = replace(semantic.particles, topology=renamed)

    np.testing.assert_allclose(stepped(rename), stepped(lambda _: None), atol=1e-9)


def test_a_robot_without_words_for_places_keeps_none() -> None:
    building = room_hall_room()
    semantic = building.filter(symbols=SYMBOL_SPACES["husky"])
    building.walk(semantic, *TO_THE_HALL)
    belief = belief_in(building, semantic)
    assert belief.node_regions.shape == (0, len(belief.trajectory))
    assert not len(belief.node)
    assert set(belief.topology.tolist()) == {0}


def test_scene_observations_that_are_late_or_broken_are_no_evidence() -> None:
    building, node = room_hall_room(), MappingNode(RunConfig(robot="wheelchair"), rng())
    handlers = node.handlers()
    building.time_ns = 10**9
    scene = building.scene()
    once, twice = MappingNode(RunConfig(robot="wheelchair"), rng()).handlers(), handlers
    broken = np.full_like(scene.probabilities, np.nan)
    for takes, messages in (
        (once, [scene]),
        (twice, [scene, scene, msgspec.structs.replace(scene, probabilities=broken)]),
    ):
        told = [out.message for message in messages for out in takes[topics.SCENE](message)]
        assert all(isinstance(message, Fault) for message in told)
        assert len(told) == len(messages) - 1
    beliefs = [
        next(iter(takes[topics.DETECTIONS](building.nothing_detected()))).message
        for takes in (once, twice)
    ]
    assert encode(beliefs[0]) == encode(beliefs[1])


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.mark.parametrize(("door", "possible"), [(False, False), (True, True)])
def test_no_place_is_imagined_where_no_way_leads(door: bool, possible: bool) -> None:
    """A room, and unknown ground behind its wall that has walls all round."""
    grid = Grid((0.0, 0.0), 0.1)

    def fill(left: float, down: float, right: float, up: float, value: float) -> None:
        columns, rows = (
            slice(*np.rint((np.array(ends) - origin) / 0.1).astype(int).tolist())
            for ends, origin in zip(((left, right), (down, up)), grid.origin, strict=True)
        )
        grid.occupancy[rows, columns] = value

    fill(-0.2, -0.2, 6.2, 8.2, 4.0)
    fill(0.0, 4.2, 6.0, 8.0, 0.0)
    fill(0.0, 0.0, 6.0, 4.0, -4.0)
    if door:
        fill(2.5, 4.0, 3.5, 4.2, -4.0)
    nodes = np.array([[2.0, 3.0], [4.0, 3.0]])
    layout = layout_of(nodes, np.zeros((0, 2)), np.zeros((0, 2)), grid)
    behind = layout.log_unseen(np.array([[3.0, 5.5]]))
    assert (behind == 0.0).all() == possible
    assert layout.log_unseen(nodes).max() < -1
