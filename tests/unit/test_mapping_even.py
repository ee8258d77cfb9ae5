"""Hypotheses cover what is believed evenly, and stay where they were."""

from dataclasses import replace

import numpy as np
import pytest

from schemas.arrays import Floats
from schemas.geometry import Pose2
from services.mapping.annotations import Reading
from services.mapping.even import EvenPoints, along_curve, copies, even_thresholds
from services.mapping.grid import Grid
from services.mapping.objects import columns
from services.mapping.particles import Particles
from services.mapping.proposal import fresh_particles
from services.mapping.relation_table import relation_named
from services.mapping.target import Evidence

BEHIND = Reading(0.0, 1, relation_named("back", False), 0, False)
ALONE = Reading(0.0, 1, None, None, False)
DISCS = np.mgrid[-2:16:2, -9:9:2].reshape(2, -1).T.astype(np.float64)


def evidence(reading: Reading, looked_until: float = 0.0) -> Evidence:
    """Nothing was seen; the ground ahead was looked at as far as `looked_until`."""
    grid = Grid((0.0, 0.0))
    y, x = np.indices(grid.looked.shape) * 0.2 + grid.origin[:, None, None]
    grid.looked[(np.abs(y) < 3.0) & (x > -3.0) & (x < looked_until)] = np.log(0.01)
    classes = ("cone", "hydrant")
    return Evidence(classes, columns([], 2), grid, Pose2(0.0, 0.0, 0.0), (reading,))


def drawn(reading: Reading, seed: int, looked_until: float = 0.0, count: int = 100) -> Particles:
    points = EvenPoints(np.random.default_rng(seed))
    return fresh_particles(count, evidence(reading, looked_until), points).resampled(
        count, points.start
    )


def masses(particles: Particles) -> Floats:
    """Weight of the figures in each disc of 2 m (D,)."""
    apart = particles.figure_position[:, None] - DISCS
    return particles.weights @ (np.linalg.norm(apart, axis=2) < 2.0)


def test_a_longer_sequence_begins_with_the_shorter_one() -> None:
    points = EvenPoints(np.random.default_rng(3))
    few = points.first(50).copy()
    np.testing.assert_array_equal(points.first(3000)[:50], few)
    assert (points.first(3000) > 0).all()
    assert (points.first(3000) < 1).all()


def test_the_curve_visits_every_cell_once_and_moves_to_neighbours() -> None:
    cells = 0.1 * (np.mgrid[:32, :32].reshape(2, -1).T + 0.5)
    order = np.argsort(along_curve(cells))
    assert len(np.unique(along_curve(cells))) == len(cells)
    steps = np.linalg.norm(np.diff(cells[order], axis=0), axis=1)
    np.testing.assert_allclose(steps, 0.1, atol=1e-9)


@pytest.mark.parametrize("reading", [ALONE, BEHIND])
@pytest.mark.parametrize("looked_until", [0.0, 4.0])
def test_a_hundred_cover_as_evenly_as_twice_as_many(reading: Reading, looked_until: float) -> None:
    truth = masses(drawn(reading, 100, looked_until, 4000))
    errors = np.array([masses(drawn(reading, seed, looked_until)) - truth for seed in range(8)])
    independent = np.mean(truth * (1 - truth)) / 100
    assert np.mean(errors**2) < independent / 1.6


def test_hypotheses_stay_where_nothing_was_looked_at() -> None:
    before, after = drawn(ALONE, 1), drawn(ALONE, 1, looked_until=1.0)
    fresh = drawn(ALONE, 2, looked_until=1.0)
    change = np.abs(masses(after) - masses(before)).sum()
    assert change < 0.5 * np.abs(masses(fresh) - masses(before)).sum()


def test_numbering_hypotheses_otherwise_changes_nothing() -> None:
    pool = fresh_particles(100, evidence(BEHIND), EvenPoints(np.random.default_rng(0)))
    order = np.random.default_rng(1).permutation(len(pool)).astype(np.int32)
    once, twice = pool.resampled(100, 0.4), pool.take(order).resampled(100, 0.4)
    np.testing.assert_array_equal(once.figure_position, twice.figure_position)


def test_each_grounding_keeps_its_share_within_one_copy() -> None:
    pool = fresh_particles(100, evidence(ALONE), EvenPoints(np.random.default_rng(0)))
    half = np.arange(len(pool)) % 2
    both = replace(pool, reading=half.astype(np.int32))
    share = both.weights[half == 1].sum()
    assert abs(100 * share - np.sum(both.resampled(100, 0.7).reading)) <= 1


def test_copies_add_up_and_follow_the_weights() -> None:
    rng = np.random.default_rng(2)
    weights = rng.dirichlet(np.full(300, 0.1))
    taken = copies(weights, even_thresholds(np.zeros((300, 1), np.int32), 0.2), 100)
    assert taken.sum() == 100
    assert (np.abs(taken - 100 * weights) <= 1).all()


def test_copies_of_a_group_do_not_depend_on_what_else_there_is() -> None:
    alone = even_thresholds(np.array([[1], [1], [1]], np.int32), 0.2)
    beside = even_thresholds(np.array([[0], [0], [1], [1], [1]], np.int32), 0.2)
    np.testing.assert_array_equal(beside[2:], alone)
