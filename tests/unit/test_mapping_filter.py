"""Laws of the particle mathematics, the pose graph and the association."""

from dataclasses import replace

import numpy as np
import pytest

from schemas.geometry import Pose2
from services.mapping.annotations import Reading
from services.mapping.association import match
from services.mapping.backbone import Backbone, Uncertainty
from services.mapping.even import EvenPoints
from services.mapping.graph import Motion, Problem, Sighting, add_motion, add_sighting
from services.mapping.grid import Grid
from services.mapping.object_map import ObjectMap
from services.mapping.objects import TrackedObject, columns
from services.mapping.odometer import OdometryNoise
from services.mapping.particles import Particles, empty_particles
from services.mapping.proposal import fresh_particles
from services.mapping.relation_table import relation_named
from services.mapping.sensing import Picture
from services.mapping.target import Evidence, log_target
from services.mapping.visibility import View

pytestmark = pytest.mark.usefixtures("without_learning")

CLASSES = ("cone", "hydrant")
ORIGIN = Pose2(0.0, 0.0, 0.0)
ALL = np.ones(len(CLASSES), np.bool_)
BEHIND = Reading(0.0, 1, relation_named("back", False), 0, False)


def thing(number: int, kind: int, x: float, y: float) -> TrackedObject:
    likely = np.full(2, 0.02)
    likely[kind] = 0.98
    return TrackedObject(
        number=number,
        mean=np.array([x, y]),
        covariance=0.01 * np.eye(2),
        extent=np.array([0.4, 0.4, 0.7]),
        class_log=np.log(likely),
        odds=4.0,
        hits=9,
        seen_with=Uncertainty(0.0, 0.0),
    )


def evidence(*things: TrackedObject, reading: Reading = BEHIND) -> Evidence:
    objects = columns(list(things), len(CLASSES))
    return Evidence(CLASSES, objects, Grid((0.0, 0.0)), ORIGIN, (reading,))


def share(particles: Particles, figure: int, landmark: int) -> float:
    rows = (particles.figure == figure) & (particles.landmark == landmark)
    return float(particles.weights[rows].sum())


def test_fresh_hypotheses_are_a_distribution_over_all_four_groundings() -> None:
    facts = evidence(thing(0, 0, 6.0, 0.0), thing(1, 1, 9.0, 0.0))
    pool = fresh_particles(100, facts, points())
    assert pool.weights.sum() == pytest.approx(1.0)
    shares = [share(pool, f, c) for f in (1, 1000) for c in (0, 1001)]
    assert sum(shares) == pytest.approx(1.0, abs=1e-3)
    assert shares[0] > 0.8
    assert min(shares) > 0


def test_importance_sampling_agrees_with_integration() -> None:
    """Mass of "seen hydrant" against "hydrant elsewhere" for a figure alone, on a fine grid."""
    reading = Reading(0.0, 1, None, None, False)
    facts = evidence(thing(0, 1, 7.0, 3.0), reading=reading)
    pool = fresh_particles(2000, facts, points())
    axis = np.arange(-45, 45, 0.25)
    places = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    n = len(places)
    everywhere = Particles(
        log_weight=np.zeros(n),
        reading=np.zeros(n, np.int32),
        figure=np.full(n, 1000, np.int32),
        landmark=np.full(n, -1, np.int32),
        figure_position=places,
        landmark_position=np.zeros((n, 2)),
        topology=np.zeros(n, np.int32),
    )
    elsewhere = np.exp(log_target(everywhere, facts)).sum() * 0.25**2
    seen = np.exp(log_target(pool.take(np.array([0], np.int32)), facts))[0]
    assert pool.figure[0] == 0
    assert share(pool, 0, -1) == pytest.approx(seen / (seen + elsewhere), rel=0.03)


def test_a_hydrant_that_is_not_behind_the_cone_loses() -> None:
    cone, good, bad = thing(0, 0, 6.0, 0.0), thing(1, 1, 9.0, 0.0), thing(2, 1, 6.0, -4.0)
    pool = fresh_particles(100, evidence(cone, good, bad), points())
    assert share(pool, 1, 0) > 50 * share(pool, 2, 0)


def test_a_nearer_competitor_beats_the_comparative() -> None:
    nearest = Reading(0.0, 1, relation_named("near", True), 0, True)
    cone, near, far = thing(0, 0, 6.0, 0.0), thing(1, 1, 7.5, 0.0), thing(2, 1, 6.0, -3.0)
    pool = fresh_particles(100, evidence(cone, near, far, reading=nearest), points())
    assert share(pool, 1, 0) > 20 * share(pool, 2, 0)


def test_each_reading_gets_its_share_of_the_hypotheses() -> None:
    both = (
        Reading(float(np.log(0.7)), 1, relation_named("back", False), 0, False),
        Reading(float(np.log(0.3)), 1, relation_named("left", False), 0, False),
    )
    pool = fresh_particles(1000, replace(evidence(), readings=both), points())
    assert pool.weights[pool.reading == 0].sum() == pytest.approx(0.7, abs=0.03)
    left = pool.take(np.flatnonzero(pool.reading == 1).astype(np.int32))
    ahead = left.landmark_position[:, 0] > 3
    assert np.mean((left.figure_position - left.landmark_position)[ahead, 1] > 0) > 0.8


def test_beside_the_robot_needs_no_other_landmark() -> None:
    left = Reading(0.0, 1, relation_named("left", False), None, False)
    pool = fresh_particles(200, evidence(thing(0, 1, 0.3, 2.6), reading=left), points())
    assert share(pool, 0, -1) > 0.8
    new = pool.take(np.flatnonzero(pool.figure == 1000).astype(np.int32))
    assert np.mean(new.figure_position[:, 1] > 0) > 0.9


def test_the_order_of_particles_means_nothing() -> None:
    facts = evidence(thing(0, 0, 6.0, 0.0), thing(1, 1, 9.0, 0.0))
    pool = fresh_particles(100, facts, points())
    order = rng().permutation(len(pool)).astype(np.int32)
    np.testing.assert_array_equal(
        log_target(pool.take(order), facts), log_target(pool, facts)[order]
    )
    a, b = pool.resampled(4000, 0.5), pool.take(order).resampled(4000, 0.5)
    assert share(a, 1, 0) == pytest.approx(share(b, 1, 0), abs=1e-3)
    np.testing.assert_allclose(a.figure_position.mean(0), b.figure_position.mean(0), atol=0.05)


def test_resampling_keeps_each_share_within_one_copy() -> None:
    weights = np.array([0.05, 0.5, 0.15, 0.3])
    named = replace(empty_particles(4), figure=np.arange(4, dtype=np.int32))
    drawn = named.weighted(np.log(weights)).resampled(100, 0.3)
    counts = np.bincount(drawn.figure, minlength=4)
    assert (np.abs(counts - 100 * weights) <= 1).all()
    assert drawn.effective == pytest.approx(100.0)


def points() -> EvenPoints:
    return EvenPoints(rng())


def rng() -> np.random.Generator:
    return np.random.default_rng(4)


def test_a_problem_has_a_factor_for_each_edge() -> None:
    problem = Problem()
    add_motion(problem, Motion(0, 1, Pose2(1.0, 0.0, 0.0), (0.01, 0.01, 0.01), ORIGIN))
    add_sighting(problem, Sighting(0, 3, np.array([2.0, 1.0]), 0.01 * np.eye(2), np.ones(2)))
    add_sighting(problem, Sighting(1, 3, np.array([1.0, 1.0]), 0.01 * np.eye(2), None))
    assert problem.factors.size() == 3
    assert problem.values.size() == 2


def test_the_backbone_places_what_was_sighted() -> None:
    backbone = Backbone(ORIGIN, ORIGIN, np.zeros((0, 3)))
    noise = OdometryNoise(2.5e-4, 4e-4)
    for x in (0.0, 1.0, 2.0):
        here = Pose2(x, 0.0, 0.0)
        backbone.move(here, noise)
        backbone.sight(0, np.array([4.0 - x, 2.0]), 0.02 * np.eye(2), here)
        assert backbone.extend(here)
    mean, covariance = backbone.objects[0]
    np.testing.assert_allclose(mean, [4.0, 2.0], atol=0.02)
    assert np.trace(covariance) < 0.04
    assert len(backbone.trajectory) == 4


def test_refused_factors_leave_the_backbone_as_it_was() -> None:
    backbone = Backbone(ORIGIN, ORIGIN, np.zeros((0, 3)))
    backbone.extend(Pose2(1.0, 0.0, 0.0))
    before = backbone.trajectory
    backbone.restore(5, np.zeros(2), np.eye(2))
    backbone.restore(5, np.zeros(2), np.eye(2))
    assert backbone.rejected == 1
    assert backbone.extend(Pose2(2.0, 0.0, 0.0))
    np.testing.assert_allclose(backbone.trajectory[: len(before)], before, atol=1e-9)


def picture(points: list[list[float]], kinds: list[int]) -> Picture:
    places, n = np.array(points, float).reshape(-1, 2), len(kinds)
    return Picture(
        map_from_base=ORIGIN,
        points_base=places,
        points=places,
        covariances_base=np.tile(0.04 * np.eye(2), (n, 1, 1)),
        covariances=np.tile(0.04 * np.eye(2), (n, 1, 1)),
        class_probability=np.where(np.arange(2) == np.array(kinds, int)[:, None], 0.9, 0.05),
        extents=np.full((n, 3), 0.4),
        uncertainty=Uncertainty(0.0, 0.0),
    )


def test_association_is_one_to_one_and_knows_new_things() -> None:
    things = [thing(0, 0, 5.0, 0.0), thing(1, 1, 6.0, 0.5)]
    seen = picture([[6.1, 0.5], [4.9, 0.0], [9.0, 0.0]], [1, 0, 1])
    assert match(seen, things).tolist() == [1, 0, -1]


def test_a_second_box_on_one_thing_is_not_a_second_thing() -> None:
    seen = picture([[5.0, 0.0], [5.1, 0.1]], [0, 1])
    assert sorted(match(seen, [thing(0, 0, 5.0, 0.0)]).tolist()) == [-2, 0]


def test_a_hydrant_before_a_building_is_not_the_building() -> None:
    building = replace(thing(0, 0, 8.0, 0.0), extent=np.array([6.0, 6.0, 4.0]))
    assert match(picture([[6.0, 0.0]], [1]), [building]).tolist() == [-1]


def test_a_drifted_robot_recognises_a_thing_again() -> None:
    seen, known = picture([[6.3, 0.0]], [0]), [thing(0, 0, 5.0, 0.0)]
    assert match(seen, known).tolist() == [-1]
    drifted = replace(seen, uncertainty=Uncertainty(0.2, 0.01))
    assert match(drifted, known).tolist() == [0]


def test_two_estimates_that_meet_become_one_thing() -> None:
    things = ObjectMap(2)
    elder, double = thing(4, 1, 5.0, 0.0), replace(thing(5, 1, 5.1, 0.1), hits=3)
    things.restore(elder)
    things.restore(double)
    things.restore(thing(6, 1, 6.0, 0.0))
    blind = View(np.zeros(0), np.zeros(0), 0.0, 7.0)
    assert things.miss(picture([], []), blind, ALL)
    assert things.columns.number.tolist() == [4, 6]
    assert not things.miss(picture([], []), blind, ALL)


def test_a_thing_that_is_never_seen_again_leaves_the_map() -> None:
    things = ObjectMap(2)
    things.restore(thing(0, 1, 3.0, 0.0))
    plain = View(np.linspace(-0.5, 0.5, 11), np.full(11, 7.0), 0.5, 7.0)
    gone = [things.miss(picture([], []), plain, ALL) for _ in range(30)]
    assert gone.count(True) == 1
    assert gone.index(True) > 10
    assert not things.confirmed
