"""POMCP finds the obviously best of two places, and the same one for the same seed."""

from dataclasses import replace

import numpy as np

from sim.experiments.pomcp import WRONG_M, Pomcp, SearchProblem

NEAR_AND_LIKELY, FAR_AND_UNLIKELY = 0, 1


def two_places(likely: float = 0.9) -> SearchProblem:
    """A thing is at the first place, 3 m away, or at the second one, 12 m away."""
    at = np.array([[3.0, 0.0], [-12.0, 0.0]])
    return SearchProblem(
        probability=np.array([likely, 1 - likely]),
        way=np.array([3.0, 12.0]),
        between=np.linalg.norm(at[:, None] - at, axis=2),
        see_figure=0.9 * np.eye(2),
        see_landmark=np.zeros((2, 2)),
        figure_seen=np.zeros(2, np.bool_),
        landmark_seen=np.ones(2, np.bool_),
        to_figure=np.where(np.eye(2) > 0, 0.5, 15.0),
        declares=np.full(2, -1, np.int32),
        figure_id=np.full(2, -2, np.int32),
    )


def planned(problem: SearchProblem, seed: int = 0) -> np.ndarray:
    return Pomcp(problem, np.random.default_rng(seed)).plan()


def test_the_near_and_likely_place_comes_first() -> None:
    for seed in range(5):
        costs = planned(two_places(), seed)
        assert np.argmin(costs) == NEAR_AND_LIKELY
        assert 4.0 < costs[NEAR_AND_LIKELY] < 13.0


def test_a_place_is_worth_a_long_way_if_the_thing_is_there_for_sure() -> None:
    assert np.argmin(planned(two_places(likely=0.02))) == FAR_AND_UNLIKELY


def test_the_same_seed_gives_the_same_costs() -> None:
    problem = two_places()
    assert np.array_equal(planned(problem, 3), planned(problem, 3))
    assert not np.array_equal(planned(problem, 3), planned(problem, 4))


def test_a_doubtful_thing_is_not_declared_found_before_its_rival_was_looked_for() -> None:
    """Going to object 7, 1 m away, ends the search; it is what is meant with probability 0.5."""
    seen = replace(
        two_places(likely=0.5),
        way=np.array([1.0, 3.0]),
        figure_seen=np.array([True, False]),
        declares=np.array([7, -1], np.int32),
        figure_id=np.array([7, -2], np.int32),
    )
    doubtful = planned(seen)
    assert doubtful[0] > 0.4 * WRONG_M
    assert np.argmin(doubtful) == 1
    sure = planned(replace(seen, probability=np.array([0.99, 0.01])))
    assert np.argmin(sure) == 0


def test_where_nothing_can_be_seen_nothing_is_tried() -> None:
    blind = replace(two_places(), see_figure=np.zeros((2, 2)))
    assert np.isinf(planned(blind)).all()
