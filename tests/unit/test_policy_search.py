"""Laws of what comes into view on a way, and of the way that a search takes to the goal."""

import itertools

import numpy as np
import pytest

from schemas.belief import OccupancyGrid
from services.policy.candidates import Kind, looking
from services.policy.places import stand_off
from services.policy.referents import Referents
from services.policy.search import places_to_look, way_to_goal
from services.policy.sight import Legs, shown_from
from services.policy.terrain import Terrain, terrain_of
from services.policy.view import FieldOfView

ALL_ROUND = FieldOfView(np.pi, 3.0, 0.0, 1.0, 1.0)
AHEAD = FieldOfView(np.radians(35.0), 6.0, 0.0, 1.0, 1.0)
HERE = np.zeros(3)


def referents(figure, landmark=None, weights=None) -> Referents:
    """Hypotheses in which nothing was seen; without landmarks there is none to see."""
    figure = np.asarray(figure, float)
    count = len(figure)
    weights = np.ones(count) if weights is None else np.asarray(weights, float)
    return Referents(
        probability=weights / weights.sum(),
        known=np.ones(count, bool),
        figure=figure,
        figure_id=np.full(count, 1000, np.int32),
        figure_seen=np.zeros(count, bool),
        figure_existence=np.ones(count),
        figure_size=np.full(count, 0.4),
        figure_away=np.hypot(*figure.T),
        landmark=figure if landmark is None else np.asarray(landmark, float),
        landmark_seen=np.full(count, landmark is None),
        landmark_existence=np.ones(count),
        landmark_id=np.full(count, -1 if landmark is None else 2000, np.int32),
    )


def going_to(*places):
    points = np.array(places, float)
    return looking(Kind.HYPOTHESISED, points + np.array([0.1, 0.0]), points)


def ground(looked_at=()) -> Terrain:
    """Square of 60 m about the start, with places of 1 m that were looked at again and again."""
    looked = np.zeros((150, 150), np.int8)
    for x, y in looked_at:
        row, column = int((y + 30) / 0.4), int((x + 30) / 0.4)
        looked[row - 1 : row + 2, column - 1 : column + 2] = -62
    return terrain_of(
        OccupancyGrid(
            stamp_ns=0,
            origin=(-30.0, -30.0),
            resolution=0.4,
            occupancy=np.zeros_like(looked),
            looked=looked,
        )
    )


NOT_LOOKED = ground()


def ways(places, hypotheses, view=ALL_ROUND, terrain=NOT_LOOKED):
    lengths = np.hypot(*np.array(places, float).T)
    return way_to_goal(HERE, lengths, going_to(*places), hypotheses, view, terrain)


@pytest.mark.parametrize("view", [ALL_ROUND, AHEAD])
def test_first_sight_is_where_a_fine_walk_first_sees_the_point(view):
    rng = np.random.default_rng(3)
    start, end, points = (rng.uniform(-8, 8, (n, 2)) for n in (5, 6, 40))
    legs = Legs.between(start, end)
    at = legs.first_sight(points, view)
    for a, b in np.ndindex(legs.length.shape):
        steps = np.linspace(0, 1, 4001)
        heading = np.arctan2(*(end[b] - start[a])[::-1])
        places = start[a] + steps[:, None] * (end[b] - start[a])
        walk = np.column_stack([places, np.full(len(steps), heading)])
        seen = np.isfinite(shown_from(walk, points, view))
        walked = np.where(seen.any(0), steps[np.argmax(seen, 0)] * legs.length[a, b], np.inf)
        clear = np.isfinite(walked) == np.isfinite(at[a, b])
        assert clear.mean() > 0.97
        both = clear & np.isfinite(walked)
        assert at[a, b][both] == pytest.approx(walked[both], abs=0.02)


def test_no_way_is_shorter_than_straight_to_the_figure():
    figure = np.random.default_rng(0).normal((8, 0), 3, (60, 2))
    found = ways([(5, 0), (8, 4), (0, -3)], referents(figure))
    assert np.all(found > np.hypot(*figure.T) - stand_off)


def test_the_order_of_hypotheses_and_candidates_means_nothing():
    rng = np.random.default_rng(1)
    figure, places = rng.normal((8, 0), 3, (50, 2)), rng.normal((6, 0), 3, (7, 2))
    order, turn = rng.permutation(50), rng.permutation(7)
    plain = ways(places, referents(figure, figure - [2, 0]))
    mixed = ways(places[turn], referents(figure[order], figure[order] - [2, 0]))
    assert mixed == pytest.approx(plain[np.ix_(turn, order)], abs=1e-9)


def test_a_heavier_hypothesis_counts_as_two():
    figure = np.random.default_rng(2).normal((8, 0), 3, (30, 2))
    twice = np.r_[0, np.arange(30)]
    weights = np.r_[2.0, np.ones(29)]
    once = ways([(6, 0), (6, 5)], referents(figure, weights=weights))
    doubled = ways([(6, 0), (6, 5)], referents(figure[twice]))
    assert doubled[:, 1:] == pytest.approx(once, abs=1e-9)


def test_what_is_not_at_the_first_place_is_looked_for_at_the_next():
    """Two hydrants that may be: seen from 3 m, a metre for every stop, 1 m short of the thing."""
    found = ways([(6, 6)], referents([[6.0, 6.0], [6.0, -6.0]]))[0]
    there = 6 * np.sqrt(2)
    assert found[0] == pytest.approx((there - 3) + (3 - stand_off) + 1)
    assert found[1] == pytest.approx(there + 1 + (12 - 3) + (3 - stand_off) + 1)


@pytest.mark.parametrize("seed", range(4))
def test_the_best_sweep_is_that_of_trying_all_orders(seed):
    """Hydrants that may be so far apart that each must be gone to."""
    rng = np.random.default_rng(seed)
    turn = np.arange(3) * 2 * np.pi / 3
    figure = rng.uniform(6, 9, 3)[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    hypotheses = referents(figure, weights=rng.uniform(1, 2, 3))
    weight = hypotheses.probability * hypotheses.stake
    found, tried = ways(figure, hypotheses) @ weight, np.full(3, np.inf)
    for order in itertools.permutations(range(3)):
        gone, here, expected = 0.0, np.zeros(2), 0.0
        for number in order:
            gone += np.hypot(*(figure[number] - here))
            expected += weight[number] * (gone - stand_off + 1)
            gone, here = gone + 1, figure[number]
        tried[order[0]] = min(tried[order[0]], expected)
    assert found.min() == pytest.approx(tried.min())
    assert np.all(found > tried - 1e-6)


def test_a_look_on_the_way_to_another_is_no_detour():
    """Or the robot would hop from look to look and never get to where it wanted."""
    figure = np.random.default_rng(3).normal((14, 0), (2, 5), (80, 2))
    places = places_to_look(referents(figure), ALL_ROUND, NOT_LOOKED)
    directly, hopping = (ways(ends, referents(figure)) for ends in (places, places / 4))
    weight = referents(figure).probability
    assert (directly @ weight).min() < (hopping @ weight).min()


def test_seeing_the_landmark_tells_where_the_figure_is():
    """With a landmark in view on the way the search for its figure is over."""
    figure = np.array([[12.0, 8.0], [12.0, -8.0]])
    near = np.array([[6.0, 2.0], [6.0, -2.0]])
    alone = referents(figure)
    with_landmark = referents(figure, near)
    assert (ways([(6, 0)], with_landmark) @ with_landmark.probability)[0] < (
        ways([(6, 0)], alone) @ alone.probability
    )[0]


def test_an_unseen_landmark_costs_a_detour_to_confirm_it():
    figure, far = np.array([[6.0, 0.0]]), np.array([[6.0, 9.0]])
    assert ways([(5, 0)], referents(figure, far)) > ways([(5, 0)], referents(figure))


def test_who_looked_well_does_not_look_again():
    """Or the robot turns back to what it just left, and away from it as soon as it is near."""
    hypotheses = referents([[2.0, 0.0], [-9.0, 0.0]], weights=[1, 3])
    looked = ground(looked_at=[(2.0, 0.0)])
    near, far = [(3.0, 0.0)], [(-9.0, 0.0)]
    way_of_looked = [ways(to, hypotheses, terrain=looked)[0, 0] for to in (near, far)]
    left = [ways(to, hypotheses, terrain=looked)[0, 1] for to in (near, far)]
    assert way_of_looked == pytest.approx(left)
    assert len(places_to_look(hypotheses, ALL_ROUND, looked)) == 1


def test_where_all_was_looked_at_no_way_is_better_than_another():
    hypotheses = referents([[2.0, 0.0], [-9.0, 0.0]])
    looked = ground(looked_at=[(2.0, 0.0), (-9.0, 0.0)])
    assert np.ptp(ways([(3.0, 0.0), (-5.0, 4.0)], hypotheses, terrain=looked)) == 0
    assert len(places_to_look(hypotheses, ALL_ROUND, looked)) == 0


def test_a_metre_counts_for_one_on_average_and_for_more_where_the_goal_is_near():
    hypotheses = referents([[5.0, 0.0], [0.0, 10.0], [0.0, 0.1]], weights=[2, 1, 1])
    stake = hypotheses.stake
    assert stake @ hypotheses.probability == pytest.approx(1.0)
    assert stake[0] == pytest.approx(2 * stake[1])
    assert np.isfinite(stake).all()
    assert stake[2] == stake.max()
