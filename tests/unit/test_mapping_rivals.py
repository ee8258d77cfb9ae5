"""The comparative over all candidates, and what is believed before anything is seen."""

from typing import get_args

import numpy as np
import pytest

from schemas.geometry import Pose2
from services.mapping import prior
from services.mapping.annotations import Reading
from services.mapping.grid import Grid
from services.mapping.objects import ObjectColumns
from services.mapping.particles import Particles
from services.mapping.place_prior import by_hand
from services.mapping.prior import Role
from services.mapping.relation_table import relation_named
from services.mapping.rivals import disc_round, log_no_unseen_rival
from services.mapping.target import Evidence, log_target
from services.mapping.training.groundings import fit_densities, score
from services.mapping.training.place_fit import fit_places
from services.mapping.training.worlds import FIRST_SEED, places_meant, sample_worlds

NEAREST = Reading(0.0, 0, relation_named("near", True), 1, True)


def things(rival: float, x: float) -> ObjectColumns:
    """A hydrant 3 m from a cone at (6, 0), and something at (x, 0) that may be a hydrant."""
    likely = np.array([[0.97, 0.03], [0.03, 0.97], [rival, 1 - rival]])
    return ObjectColumns(
        number=np.arange(3, dtype=np.int32),
        mean=np.array([[9.0, 0.0], [6.0, 0.0], [x, 0.0]]),
        covariance=np.tile(0.01 * np.eye(2), (3, 1, 1)),
        radius=np.full(3, 0.2),
        half_extent=np.full((3, 2), 0.2),
        class_log=np.log(likely),
        existence=np.full(3, 0.98),
    )


def value_of_pair(rival: float = 0.03, x: float = 20.0, looked: bool = True) -> float:
    grid = Grid((0.0, 0.0))
    if looked:
        grid.looked[:] = np.log(0.002)
    classes = ("hydrant", "cone")
    facts = Evidence(classes, things(rival, x), grid, Pose2(0.0, 0.0, 0.0), (NEAREST,))
    index = np.zeros(1, np.int32)
    pair = Particles(
        log_weight=np.zeros(1),
        reading=index,
        figure=index,
        landmark=index + 1,
        figure_position=np.array([[9.0, 0.0]]),
        landmark_position=np.array([[6.0, 0.0]]),
        topology=index,
    )
    return float(log_target(pair, facts)[0])


def test_a_rival_counts_by_how_likely_it_is_one() -> None:
    values = [value_of_pair(rival, 7.5) for rival in (0.03, 0.3, 0.6, 0.97)]
    assert values == sorted(values, reverse=True)
    assert values[0] - values[-1] > 2.5


def test_a_rival_that_is_farther_away_is_none() -> None:
    assert value_of_pair(0.97, 12.0) == pytest.approx(value_of_pair(0.03, 12.0), abs=1e-3)


def test_where_nobody_looked_there_may_be_a_rival() -> None:
    doubt = value_of_pair(looked=True) - value_of_pair(looked=False)
    expected = np.pi * 3.0**2 * prior.density_of("hydrant")
    assert doubt == pytest.approx(expected, rel=0.05)


def test_the_disc_is_even_and_reaches_as_far_as_the_figure() -> None:
    disc = disc_round(np.array([[1.0, 2.0]]), np.array([3.0]))[0] - [1.0, 2.0]
    radius = np.linalg.norm(disc, axis=1)
    assert radius.max() < 3.0
    np.testing.assert_allclose(np.mean(radius**2), 3.0**2 / 2, rtol=0.01)
    np.testing.assert_allclose(disc.mean(axis=0), 0.0, atol=0.1)


def test_doubt_is_bounded() -> None:
    doubt = log_no_unseen_rival(np.array([100.0]), np.zeros((1, 24)), 0.01)
    assert doubt[0] == pytest.approx(np.log(0.01), abs=0.01)


@pytest.mark.parametrize("role", get_args(Role))
def test_places_learned_are_likelier_than_by_hand_in_other_worlds(role: Role) -> None:
    fitted, others = sample_worlds(30, FIRST_SEED), sample_worlds(30, FIRST_SEED + 500)
    learned = fit_places(places_meant(fitted, role))
    places = places_meant(others, role)
    assert learned.log_density(places).mean() > by_hand.log_density(places).mean()
    assert learned.shares.sum() == pytest.approx(1.0)


@pytest.mark.slow
def test_densities_that_are_fitted_make_the_truth_likelier() -> None:
    scored = score(sample_worlds(10, FIRST_SEED), np.random.default_rng(0))
    again = score(sample_worlds(10, FIRST_SEED), np.random.default_rng(0))
    np.testing.assert_array_equal(scored.mass, again.mass)
    change = fit_densities(scored)
    before, after = (np.log(scored.probability(one)).mean() for one in (np.zeros(2), change))
    assert after >= before
    assert (scored.probability(change) <= 1.0).all()
