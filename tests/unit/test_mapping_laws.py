"""Laws of the backbone and of the leaves that hypotheses hang on it."""

import gtsam
import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from schemas import codec, topics
from schemas.belief import MapBelief
from schemas.geometry import Pose2
from services.mapping import graph
from services.mapping.backbone import Backbone
from services.mapping.marginals import information_of, marginals_of
from services.mapping.odometer import OdometryNoise
from services.mapping.particles import Particles
from services.mapping.target import log_target
from tests.unit.test_mapping_episode import FRAME_NS, World, make_node, says
from tests.unit.test_mapping_faults import assert_sound

ORIGIN = Pose2(0.0, 0.0, 0.0)
NOISE = OdometryNoise(2.5e-4, 4e-4)
PLACES = np.array([[3.0, 2.0], [5.0, -2.0], [8.0, 1.0], [9.0, -3.0]])
SEEN_FROM = {0: (0, 1, 2), 1: (1, 3, 4), 2: (4, 6), 3: (6,)}
"""Objects, and the pose nodes from which each was seen."""


def mapped() -> Backbone:
    """Eight poses along a bent way, four objects seen from some of them, with noise."""
    rng = np.random.default_rng(2)
    backbone, odom = Backbone(ORIGIN, ORIGIN, np.zeros((0, 3))), ORIGIN
    for node in range(8):
        for number, nodes in SEEN_FROM.items():
            if node in nodes:
                point = odom.inverse().apply(PLACES[number]) + 0.05 * rng.standard_normal(2)
                backbone.sight(number, point, 0.02 * np.eye(2), odom)
        odom = odom @ Pose2(1.0, 0.0, 0.1)
        backbone.move(odom, NOISE)
        assert backbone.extend(odom)
    return backbone


def test_the_information_matrix_is_the_structure_of_the_graph() -> None:
    backbone = mapped()
    count, poses = len(PLACES), len(backbone.trajectory)
    matrix = information_of(backbone._isam, 2 * count + 3 * poses).toarray()
    starts = [*range(0, 2 * count, 2), *range(2 * count, len(matrix), 3), len(matrix)]
    expected = {(number, count + node) for number, nodes in SEEN_FROM.items() for node in nodes}
    expected |= {(count + node, count + node + 1) for node in range(poses - 1)}
    blocks = len(starts) - 1
    found = {
        (row, column)
        for row in range(blocks)
        for column in range(row + 1, blocks)
        if matrix[starts[row] : starts[row + 1], starts[column] : starts[column + 1]].any()
    }
    assert found == expected
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix)[0] > 0


def test_covariances_are_those_of_the_solver() -> None:
    backbone = mapped()
    isam, poses = backbone._isam, len(backbone.trajectory)
    found = marginals_of(isam, len(PLACES), poses)
    for number in range(len(PLACES)):
        wanted = isam.marginalCovariance(graph.object_key(number))
        np.testing.assert_allclose(found.objects[number], wanted, atol=1e-12)
        np.testing.assert_allclose(backbone.objects[number][1], wanted, atol=1e-12)
    wanted = isam.marginalCovariance(graph.pose_key(poses - 1))
    np.testing.assert_allclose(found.last_pose, wanted, atol=1e-12)


def test_a_leaf_of_language_leaves_the_backbone_as_it_is() -> None:
    """The full joint of a hypothesis equals the shared backbone and a leaf beside it, to 1e-9."""
    backbone = mapped()
    isam, leaf, landmark = gtsam.ISAM2(backbone._isam), graph.object_key(99), 2
    offset, spread = np.array([2.4, 0.3]), np.diag([1.0, 0.64])
    mean, covariance = backbone.objects[landmark]
    problem = graph.Problem()
    noise = gtsam.noiseModel.Gaussian.Covariance(spread)
    problem.factors.add(gtsam.BetweenFactorPoint2(graph.object_key(landmark), leaf, offset, noise))
    problem.values.insert(leaf, mean + offset)
    isam.update(problem.factors, problem.values)
    joint = isam.calculateEstimate()
    np.testing.assert_allclose(joint.atPoint2(leaf), mean + offset, atol=1e-9)
    np.testing.assert_allclose(isam.marginalCovariance(leaf), covariance + spread, atol=1e-9)
    for number, (place, own) in backbone.objects.items():
        key = graph.object_key(number)
        np.testing.assert_allclose(joint.atPoint2(key), place, atol=1e-9)
        np.testing.assert_allclose(isam.marginalCovariance(key), own, atol=1e-9)
    poses = gtsam.utilities.extractPose2(joint)
    np.testing.assert_allclose(poses, backbone.trajectory, atol=1e-9)


def test_a_copy_of_the_solver_is_a_map_of_its_own() -> None:
    """Particles that share history may fork from it: neither sees the other's edges."""
    backbone = mapped()
    fork, before = gtsam.ISAM2(backbone._isam), backbone.trajectory
    problem = graph.Problem()
    graph.add_object_prior(problem, 50, np.array([1.0, 1.0]), np.eye(2))
    graph.add_sighting(problem, graph.Sighting(3, 50, np.array([4.0, 4.0]), 0.01 * np.eye(2), None))
    fork.update(problem.factors, problem.values)
    np.testing.assert_allclose(
        gtsam.utilities.extractPose2(backbone._isam.calculateEstimate()), before, atol=1e-12
    )


log_weights = st.lists(
    st.one_of(st.floats(-1e6, 1e6), st.sampled_from([np.nan, np.inf, -np.inf, 0.0, -745.0, 1e300])),
    min_size=1,
    max_size=12,
)


@given(log_weights)
@settings(max_examples=60, deadline=None)
def test_weights_are_a_distribution_whatever_they_are_made_of(values: list[float]) -> None:
    count = len(values)
    rows, zeros = np.zeros(count, np.int32), np.zeros((count, 2))
    bare = Particles(np.zeros(count), rows, rows, rows, zeros, zeros, rows)
    made = bare.weighted(np.array(values))
    assert made.weights.sum() == pytest.approx(1.0)
    assert (made.weights >= 0).all()
    drawn = made.resampled(7, 0.5)
    assert drawn.weights.sum() == pytest.approx(1.0)


junk = st.sampled_from(
    ["drive", "twice", "late", "nan centre", "no covariance", "no class", "jump", "nan odometry"]
)


@given(st.lists(junk, min_size=1, max_size=12), st.integers(0, 3))
@settings(
    max_examples=12, deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True
)
def test_no_sequence_of_inputs_breaks_the_distribution(kinds: list[str], seed: int) -> None:
    world = World([("cone", 4.0, 1.0), ("hydrant", 6.0, -0.5)], np.random.default_rng(seed))
    node = make_node(seed, particles=20)
    handlers = node.handlers()
    list(handlers[topics.ANNOTATIONS](says("hydrant", "back", "cone")))
    for kind in ["drive", *kinds, "drive"]:
        for output in [o for topic, m in _inputs(world, kind) for o in handlers[topic](m)]:
            if isinstance(output.message, MapBelief):
                assert_sound(output.message)


def _inputs(world: World, kind: str) -> list[tuple]:
    if kind != "twice":
        world.time_ns += FRAME_NS
    if kind == "jump":
        world.odom = world.odom @ Pose2(-7.0, 12.0, 2.5)
    if kind == "drive":
        world.true, world.odom = (pose @ Pose2(0.2, 0.0, 0.05) for pose in (world.true, world.odom))
    picture, odometry = world.look(), world.odometry()
    broken: dict[str, dict[str, object]] = {
        "late": {"stamp_ns": world.time_ns - 1_500_000_000},
        "nan centre": {"centers_base": picture.centers_base * np.nan},
        "no covariance": {"covariances": picture.covariances * 0},
        "no class": {"classes": ()},
    }
    picture = msgspec.structs.replace(picture, **broken.get(kind, {}))
    if kind == "nan odometry":
        odometry = msgspec.structs.replace(odometry, odom_from_base=Pose2(np.nan, 0.0, 0.0))
    return [(topics.ODOMETRY, odometry), (topics.DETECTIONS, picture)]


def run_of(seed: int) -> list[bytes]:
    world = World([("cone", 4.0, 1.0), ("hydrant", 6.0, -0.5)], np.random.default_rng(7))
    node, said = make_node(seed, particles=30), list[bytes]()
    handlers = node.handlers()
    list(handlers[topics.ANNOTATIONS](says("hydrant", "back", "cone")))
    for kind in ["drive"] * 8 + ["jump", "late", "no class"] + ["drive"] * 4:
        for topic, message in _inputs(world, kind):
            said += [codec.encode(output.message) for output in handlers[topic](message)]
    return said


def test_one_seed_gives_one_run_byte_for_byte_with_faults_and_all() -> None:
    assert run_of(3) == run_of(3)
    assert run_of(3) != run_of(4)


def test_relabelling_particles_changes_nothing() -> None:
    world = World([("cone", 4.0, 1.0), ("hydrant", 6.0, -0.5)], false_rate=0.0)
    node, twin = make_node(1), make_node(1)
    for one in (node, twin):
        one.on_annotations(says("hydrant", "back", "cone"))
    order = np.random.default_rng(0).permutation(100).astype(np.int32)
    twin._filter.particles = twin._filter.particles.take(order)
    twin._filter._log_target = twin._filter._log_target[order]
    first, second = node._filter, twin._filter
    # Before anything is drawn anew, every hypothesis keeps its weight under its new name.
    world.time_ns += FRAME_NS
    picture = world.look()
    for one in (first, second):
        one._look(picture, one._propagate(picture))
        one._weigh()
    np.testing.assert_allclose(second.particles.weights, first.particles.weights[order], rtol=1e-12)
    np.testing.assert_array_equal(
        log_target(second.particles, second.evidence),
        log_target(first.particles, first.evidence)[order],
    )
    assert second.particles.effective == pytest.approx(first.particles.effective)
