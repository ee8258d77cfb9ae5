"""Laws of regions, their edges and their types, whatever the sensors say."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest

from schemas.geometry import Pose2
from services.mapping import semantics
from services.mapping.allocation import Branch, Topologies, propagate
from services.mapping.atlas import Atlas
from services.mapping.outlines import outline_of
from services.mapping.region_edges import edge_probability
from services.mapping.segmentation import bisect, normalised_cut, split_probability
from services.mapping.topology import Topology, assignment, beginning
from tests.building import TYPES, Building

Way = list[tuple[float, float]]
COUNT = 1000
ROOM: Way = [(1.0, 1.0), (1.0, 2.0), (1.0, 3.0), (1.0, 4.0), (3.0, 4.0), (3.0, 3.0), (3.0, 2.0)]
CORNER: Way = [*((x, 1.2) for x in np.arange(1.0, 11.0)), *((10.8, y) for y in np.arange(2.0, 9.0))]


def room() -> Building:
    return Building([("office", (0, 0, 6, 6))], [], ROOM[0])


def two_hallways() -> Building:
    rooms = [("hallway", (0, 0, 12, 2.4)), ("hallway", (9.6, 2.2, 12, 12))]
    return Building([(name, box) for name, box in rooms], [], CORNER[0])


def explored(building: Building, way: Way, kind: str) -> Atlas:
    """Pose nodes with scans along a way; all look like one type of place."""
    atlas, poses = Atlas(len(TYPES)), list[list[float]]()
    look = np.log(np.where(np.array(TYPES) == kind, 0.9, 0.1 / (len(TYPES) - 1)))
    for x, y in way:
        building.pose = Pose2(float(x), float(y), 0.0)
        here = building.odometry
        poses.append([here.x, here.y, here.yaw])
        atlas.extend(np.array(poses), 1e-4, outline_of(building.scan(), here))
        atlas.looks.add(len(atlas) - 1, atlas.stands[-1], look)
    return atlas


def evenly(count: int = COUNT) -> np.ndarray:
    return (np.random.default_rng(1).permutation(count) + 0.5) / count


def lengthened(topology: Topology, atlas: Atlas) -> list[tuple[Topology, float]]:
    """What becomes of a topology with the last node, and in which share of the particles."""
    one = Topologies((topology,), np.zeros(1))
    after, owner = propagate(one, np.zeros(COUNT, np.int32), evenly(), atlas)
    shares = np.bincount(owner, minlength=len(after.members)) / COUNT
    np.testing.assert_allclose(np.exp(after.log_prior), shares, atol=1e-9)
    return list(zip(after.members, shares.tolist(), strict=True))


def test_the_best_cut_is_the_weakest_tie() -> None:
    blocks = np.full((9, 9), 0.05)
    blocks[:4, :4] = blocks[4:, 4:] = 0.9
    np.fill_diagonal(blocks, 1.0)
    order = np.random.default_rng(0).permutation(9)
    shuffled = blocks[np.ix_(order, order)]
    cut = bisect(shuffled)
    assert {frozenset(order[cut.first].tolist()), frozenset(order[~cut.first].tolist())} == {
        frozenset(range(4)),
        frozenset(range(4, 9)),
    }
    assert cut.value == pytest.approx(normalised_cut(shuffled, cut.first))
    assert cut.value < normalised_cut(shuffled, np.arange(9) < 2)


def test_the_likelihood_of_a_division_follows_the_paper() -> None:
    assert split_probability(0.0) == 1.0
    assert split_probability(0.16) == pytest.approx(1 / (1 + 20 * 0.16**3))
    assert split_probability(0.2) > split_probability(0.4) > split_probability(1.0)


def test_the_probability_of_an_edge_is_the_mean_over_a_folded_gaussian() -> None:
    rng = np.random.default_rng(0)
    distance, deviation = np.array([0.5, 2.0, 8.0]), np.array([0.3, 1.0, 0.5])
    draws = np.abs(distance + deviation * rng.standard_normal((200_000, 3)))
    expected = np.mean(1 / (1 + 0.3 * draws**2), axis=0)
    np.testing.assert_allclose(edge_probability(distance, deviation), expected, atol=3e-3)
    sharp = edge_probability(np.array([2.0]), np.zeros(1))
    assert sharp[0] == pytest.approx(1 / (1 + 0.3 * 4))


@pytest.mark.parametrize("probability", [0.0, 0.07, 0.5, 1.0])
def test_the_right_share_of_the_particles_decides_and_keeps_its_randomness(
    probability: float,
) -> None:
    branch = Branch(beginning, np.arange(COUNT, dtype=np.int32), evenly())
    yes, no = branch.decided(probability)
    assert len(yes.rows) == round(COUNT * probability)
    assert sorted([*yes.rows, *no.rows]) == list(range(COUNT))
    for part in (yes, no):
        if len(part.rows):
            assert np.mean(part.uniforms) == pytest.approx(0.5, abs=0.05)
            assert part.uniforms.min() >= 0.0
            assert part.uniforms.max() < 1.0


def test_edges_to_other_regions_are_as_frequent_as_the_formula_says() -> None:
    atlas = explored(two_hallways(), CORNER, "hallway")
    nodes = range(len(CORNER) - 1)
    start = Topology(beginning.regions, frozenset())
    for node in nodes[1:]:
        start = start.with_node(node, start.region_of(node - 1))
    # A third region at the beginning, with no edge, so that the new one may sample one to it.
    start = replace(start.divided(start.regions[0], nodes[:2], 1.0), edges=frozenset())
    divided = [(t, share) for t, share in lengthened(start, atlas) if len(t.regions) == 3]
    total = sum(share for _, share in divided)
    first, _, last = divided[0][0].regions
    ends = [atlas.poses[atlas.central(region), :2] for region in (first, last)]
    gap = np.linalg.norm(ends[0] - ends[1])
    expected = edge_probability(np.array([gap]), np.sqrt([2e-4]))[0]
    joined = sum(share for t, share in divided if (first.name, last.name) in t.edges)
    assert total > 0.2
    assert joined / total == pytest.approx(expected, abs=0.03)


def halves(way: Way, at: int) -> Topology:
    """All nodes but the last, divided in two."""
    topology = beginning
    for node in range(1, len(way) - 1):
        topology = topology.with_node(node, topology.region_of(node - 1))
    return topology.divided(topology.regions[0], range(at), 1.0)


def test_two_halves_of_one_room_merge() -> None:
    after = lengthened(halves(ROOM, 3), explored(room(), ROOM, "office"))
    assert sum(share for topology, share in after if len(topology.regions) == 1) > 0.8


def test_two_hallways_that_touch_do_not_merge() -> None:
    after = lengthened(halves(CORNER, 10), explored(two_hallways(), CORNER, "hallway"))
    assert sum(share for topology, share in after if len(topology.regions) == 1) == 0.0


def test_halves_of_one_room_that_look_different_stay_two() -> None:
    atlas = explored(room(), ROOM, "office")
    other = np.log(np.where(np.array(TYPES) == "kitchen", 0.9, 0.1 / (len(TYPES) - 1)))
    for node in range(3, len(ROOM)):
        for _ in range(20):
            atlas.looks.add(node, atlas.stands[node], other)
    after = lengthened(halves(ROOM, 3), atlas)
    assert sum(share for topology, share in after if len(topology.regions) >= 2) > 0.95


def test_a_declined_division_is_not_drawn_again_until_more_speaks_for_it() -> None:
    atlas = explored(two_hallways(), CORNER[:6], "hallway")
    topology = beginning
    for node in range(1, 5):
        topology = topology.with_node(node, topology.region_of(node - 1))
    likelihoods = []
    for _ in range(2):
        after = lengthened(topology, atlas)
        likelihoods.append(sum(share for t, share in after if len(t.regions) > 1))
        whole = next(t.regions[0] for t, _ in after if len(t.regions) == 1)
        topology = replace(
            topology, regions=(replace(topology.regions[0], kept_whole=whole.kept_whole),)
        )
    assert likelihoods[0] > 0.0
    assert likelihoods[1] == 0.0


def test_sharing_changes_nothing() -> None:
    atlas = explored(two_hallways(), CORNER, "hallway")
    topology = halves(CORNER, 10)
    shared, own = propagate(
        Topologies((topology,), np.zeros(1)), np.zeros(100, np.int32), evenly(100), atlas
    )
    alone = Topologies((topology,) * 100, np.full(100, -np.log(100)))
    unshared, theirs = propagate(alone, np.arange(100, dtype=np.int32), evenly(100), atlas)
    assert [shared.members[k] for k in own] == [unshared.members[k] for k in theirs]
    np.testing.assert_allclose(shared.log_prior[own], unshared.log_prior[theirs], atol=1e-9)


def test_messages_agree_with_a_general_solver() -> None:
    """Marginals of the whole factor graph, with appearance and language as variables of it."""
    types, rng = 5, np.random.default_rng(0)
    classifier = np.log(rng.dirichlet(np.ones(types), 4))
    region = np.array([0, 0, 0, 1], np.int32)
    beliefs, _ = semantics.type_belief(semantics.appearance_message(classifier), region, 2)
    names = semantics.name_message(beliefs)
    same = np.eye(types)
    alike = (0.9 * same + 0.1 / (types - 1) * (1 - same)).flatten().tolist()
    named = (0.99 * same + 0.01 / (types - 1) * (1 - same)).flatten().tolist()
    graph = gtsam.DiscreteFactorGraph()
    for node, owner in enumerate(region.tolist()):
        appearance, kind = (10 + node, types), (owner, types)
        graph.add(appearance, np.exp(classifier[node]).tolist())
        graph.push_back(gtsam.DecisionTreeFactor([kind, appearance], alike))
    for owner in range(2):
        called = gtsam.DecisionTreeFactor([(owner, types), (20 + owner, types)], named)
        graph.push_back(called)
    marginals = gtsam.DiscreteMarginals(graph)
    for owner in range(2):
        kinds = marginals.marginalProbabilities((owner, types))
        np.testing.assert_allclose(np.exp(beliefs[owner]), kinds, atol=1e-9)
        calls = marginals.marginalProbabilities((20 + owner, types))
        np.testing.assert_allclose(np.exp(names[owner]), calls, atol=1e-9)


def test_every_node_has_one_region() -> None:
    topology = halves(CORNER, 10)
    owner = assignment(topology.partition, len(CORNER))
    assert owner[-1] == -1
    assert (owner[:-1] >= 0).all()
    union = topology.merged(*topology.regions, kept_whole=0.0)
    assert union.partition == (tuple(range(len(CORNER) - 1)),)
    assert not union.edges
