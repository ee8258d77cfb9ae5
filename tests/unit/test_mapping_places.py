"""What the filter makes of rooms and hallways, told by a synthetic building."""

from collections.abc import Callable

import numpy as np
import pytest

from robots.symbols import SYMBOL_SPACES
from schemas.belief import MapBelief
from schemas.codec import decode, encode
from services.mapping.belief import belief_of
from services.mapping.filter import SemanticFilter
from services.mapping.restoration import restore
from tests.building import CLASSES, Building, means, room_hall_room

INTO_THE_HALL = ((3.0, 2.6), (5.5, 3.0), (11.0, 3.0))
INTO_THE_KITCHEN = (*INTO_THE_HALL, (14.7, 3.0), (14.7, 6.8))


def belief_in(building: Building, semantic: SemanticFilter) -> MapBelief:
    return belief_of(semantic, building.time_ns, "i", building.odometry)


def walked(
    *way: tuple[float, float], looks: bool = True, seed: int = 0
) -> tuple[Building, SemanticFilter]:
    building = room_hall_room()
    semantic = building.filter(seed=seed)
    semantic.hear((means("kitchen"),), building.odometry)
    building.sense(semantic, looks)
    building.walk(semantic, *way, looks=looks)
    return building, semantic


def share(belief: MapBelief, holds: Callable[[int], bool]) -> float:
    """Weight of the hypotheses whose topology has a property."""
    return sum(w for w, k in zip(belief.weights, belief.topology.tolist(), strict=True) if holds(k))


def names_along(belief: MapBelief, topology: int) -> list[int]:
    """Names of the regions in the order in which the robot came into them."""
    return list(dict.fromkeys(belief.node_regions[topology].tolist()))


def test_a_room_and_a_hallway_are_told_apart_at_the_door_by_scans_alone() -> None:
    building, semantic = walked(*INTO_THE_HALL, (17.0, 3.0), looks=False)
    belief = belief_in(building, semantic)
    x = belief.trajectory[:, 0] + building.start[0]

    def divided_at_the_door(topology: int) -> bool:
        regions = belief.node_regions[topology]
        first = regions == regions[0]
        return not first.all() and 4.5 < x[first].max() < 8.0 and 4.5 < x[~first].min() < 8.0

    assert share(belief, divided_at_the_door) > 0.5


def test_labels_divide_a_kitchen_from_the_hallway_as_soon_as_it_is_entered() -> None:
    building, semantic = walked(*INTO_THE_KITCHEN[:-1], (14.7, 5.8))
    belief = belief_in(building, semantic)

    def has_a_kitchen(topology: int) -> bool:
        own = (belief.particle == -2 - topology) & (
            belief.node == belief.node_regions[topology][-1]
        )
        return CLASSES[belief.class_index[own][0]] == "kitchen"

    assert share(belief, has_a_kitchen) > 0.6


def test_a_seen_kitchen_is_what_is_meant_and_a_hallway_is_not() -> None:
    building, semantic = walked(*INTO_THE_HALL)
    seen = belief_in(building, semantic)
    rows = seen.row_of(np.arange(100, dtype=np.int32), seen.figure)
    here = np.array([building.room(place) for place in seen.position[rows]])
    assert seen.weights[np.isin(here, ("hallway", "lab"))].sum() < 0.05
    building.walk(semantic, *INTO_THE_KITCHEN[-2:])
    belief = belief_in(building, semantic)
    meant = belief.row_of(np.arange(100, dtype=np.int32), belief.figure)
    is_seen = belief.seen[meant]
    assert belief.weights[is_seen].sum() > 0.6
    assert {CLASSES[c] for c in belief.class_index[meant[is_seen]]} == {"kitchen"}
    found = np.average(belief.position[meant[is_seen]], axis=0)
    assert building.room(found) == "kitchen"


def test_a_kitchen_that_is_only_looked_into_is_known_already() -> None:
    building, semantic = walked(*INTO_THE_HALL, (14.7, 3.0), (14.7, 3.2))
    belief = belief_in(building, semantic)
    far = (belief.particle == -1) & (belief.node >= 3000)
    kitchens = far & (belief.class_index == CLASSES.index("kitchen"))
    assert [building.room(place) for place in belief.position[kitchens]] == ["kitchen"]
    assert belief.weights[np.isin(belief.figure, belief.node[kitchens])].sum() > 0.5


def test_coming_back_makes_no_new_places() -> None:
    building, semantic = walked(*INTO_THE_KITCHEN)
    before = [len(topology.regions) for topology in semantic.topologies.members]
    building.walk(semantic, (14.7, 3.0), (5.5, 3.0), (2.0, 2.0))
    belief = belief_in(building, semantic)
    rooms = [len(topology.regions) for topology in semantic.topologies.members]
    shares = np.bincount(belief.topology, belief.weights)
    assert shares @ rooms < np.mean(before) + 1.0
    assert share(belief, lambda k: bool(belief.node_regions[k][-1] == 2000)) > 0.8


def test_weights_are_normalised_and_messages_survive_the_wire() -> None:
    building, semantic = walked(*INTO_THE_HALL)
    belief = belief_in(building, semantic)
    assert belief.weights.sum() == pytest.approx(1.0)
    again = decode(encode(belief), MapBelief)
    np.testing.assert_array_equal(again.node_regions, belief.node_regions)
    assert belief.node_regions.shape == (belief.topology.max() + 1, len(belief.trajectory))
    for topology in range(len(belief.node_regions)):
        rows = belief.node[belief.particle == -2 - topology]
        assert set(rows.tolist()) == set(belief.node_regions[topology].tolist())


def test_a_restart_keeps_the_places() -> None:
    building, semantic = walked(*INTO_THE_KITCHEN)
    before = belief_in(building, semantic)
    heir = building.filter(seed=1)
    restore(heir, decode(encode(before), MapBelief))
    heir.grid.restore(semantic.grid.message(0))
    heir.recall(semantic.readings)
    after = belief_in(building, heir)
    assert len(after.trajectory) == len(before.trajectory) + 1
    np.testing.assert_array_equal(after.node_regions[:, :-1], before.node_regions)
    np.testing.assert_array_equal(after.figure, before.figure)
    building.walk(heir, (14.7, 3.0), (9.0, 3.0))
    end = belief_in(building, heir)
    hallway = end.class_index == CLASSES.index("hallway")
    assert (
        share(
            end,
            lambda k: bool(
                hallway[(end.particle == -2 - k) & (end.node == end.node_regions[k][-1])].all()
            ),
        )
        > 0.6
    )


def test_a_robot_without_words_for_places_keeps_none() -> None:
    building = room_hall_room()
    semantic = building.filter(symbols=SYMBOL_SPACES["husky"])
    building.walk(semantic, *INTO_THE_HALL)
    belief = belief_in(building, semantic)
    assert belief.node_regions.shape == (0, len(belief.trajectory))
    assert not len(belief.node)
