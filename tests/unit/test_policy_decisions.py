"""Laws of the policy on beliefs written down by hand."""

from dataclasses import replace

import numpy as np
import pytest

from robots.catalogue import get_robot
from robots.husky.spec import HUSKY
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from schemas.language import Behaviors
from services.policy import places
from services.policy.belief_features import moments_of, names
from services.policy.candidates import Kind
from services.policy.cost import Circumstances
from services.policy.policy import BeliefPolicy, Memory
from services.policy.referents import from_behaviors, from_figures, mass_of
from services.policy.rule import UnknownFeatureError, load_rule

HYDRANT, CONE = 0, 1
FIGURE, LANDMARK = 1000, 1001
HERE = Pose2(0.0, 0.0, 0.0)
NOTHING_DONE = Memory(np.zeros((0, 2)), np.zeros((0, 3)), None, 0.0)


def grid_of(looked: float = 0.0, occupied: tuple[slice, slice] | None = None) -> OccupancyGrid:
    """60 m x 60 m around the origin, all free."""
    occupancy = np.full((300, 300), -20, np.int8)
    if occupied:
        occupancy[occupied] = 40
    return OccupancyGrid(
        stamp_ns=1,
        origin=(-30.0, -30.0),
        resolution=0.2,
        occupancy=occupancy,
        looked=np.full((300, 300), round(10 * looked), np.int8),
    )


def belief_of(figures, landmarks, seen=(), weights=None) -> MapBelief:
    """Particles with an (x, y) or the id of a seen object as figure and as landmark.

    `seen` holds (id, class, x, y).
    """
    rows = [(-1, number, kind, (x, y)) for number, kind, x, y in seen]
    columns = {"figure": [], "landmark": []}
    for particle, pair in enumerate(zip(figures, landmarks, strict=True)):
        for name, node, kind, thing in zip(
            columns, (FIGURE, LANDMARK), (HYDRANT, CONE), pair, strict=True
        ):
            if isinstance(thing, tuple):
                rows.append((particle, node, kind, thing))
            columns[name].append(node if isinstance(thing, tuple) else thing)
    count = len(rows)
    weights = np.ones(len(figures)) if weights is None else np.asarray(weights, float)
    return MapBelief(
        stamp_ns=5,
        instruction_id="i",
        classes=("hydrant", "cone"),
        weights=weights / weights.sum(),
        particle=np.array([row[0] for row in rows], np.int32),
        node=np.array([row[1] for row in rows], np.int32),
        class_index=np.array([row[2] for row in rows], np.int32),
        class_probability=np.ones(count),
        position=np.array([row[3] for row in rows], float).reshape(-1, 2),
        covariance=np.tile(0.01 * np.eye(2), (count, 1, 1)),
        extent=np.full((count, 3), 0.4),
        existence=np.full(count, 0.95),
        figure=np.array(columns["figure"], np.int32),
        landmark=np.array(columns["landmark"], np.int32),
        figure_class=np.full(len(figures), -1, np.int32),
        landmark_class=np.full(len(figures), -1, np.int32),
        topology=np.zeros(len(weights), np.int32),
        node_regions=np.zeros((0, 0), np.int32),
        region_edges=np.zeros((0, 3), np.int32),
        viewer=HERE,
        map_from_odom=HERE,
        map_from_base=HERE,
        trajectory=np.zeros((0, 3)),
        effective_particles=float(len(figures)),
    )


@pytest.fixture(scope="module")
def policy() -> BeliefPolicy:
    return BeliefPolicy(HUSKY, load_rule("husky"))


def decide(policy, belief, pose=HERE, grid=None, memory=NOTHING_DONE):
    return policy.decide(belief, from_figures(belief), grid or grid_of(), pose, memory)


def scattered(count: int = 40, seed: int = 3):
    rng = np.random.default_rng(seed)
    landmarks = rng.normal([8, 3], [2, 3], (count, 2))
    figures = landmarks + rng.normal([3, 0], 0.5, (count, 2))
    return [tuple(p) for p in figures.tolist()], [tuple(p) for p in landmarks.tolist()]


def test_costs_are_finite_and_the_choice_is_the_cheapest(policy):
    choice = decide(policy, belief_of(*scattered()))
    assert np.isfinite(choice.costs).all()
    assert choice.costs[choice.chosen] == choice.costs.min()


def test_relabelled_and_merged_particles_lead_to_the_same_decision(policy):
    figures, landmarks = scattered()
    weights = np.random.default_rng(0).random(len(figures))
    once = decide(policy, belief_of(figures, landmarks, weights=weights))
    order = np.random.default_rng(1).permutation(len(figures))
    doubled = [*order, *order]  # Each particle twice, at half its weight, in another order.
    again = decide(
        policy,
        belief_of(
            [figures[i] for i in doubled],
            [landmarks[i] for i in doubled],
            weights=[weights[i] / 2 for i in doubled],
        ),
    )
    assert again.kind == once.kind
    np.testing.assert_allclose(
        again.candidates.pose[again.chosen], once.candidates.pose[once.chosen], atol=1e-9
    )
    np.testing.assert_allclose(again.costs[again.chosen], once.costs[once.chosen], rtol=1e-9)


def test_never_stops_at_something_that_is_only_hypothesised(policy):
    for x in (1.0, 1.4, 3.0, 6.0):
        choice = decide(policy, belief_of([(x, 0.0)] * 5, [(x - 1, 0.0)] * 5))
        assert choice.kind is not Kind.STOP
        assert choice.confirmed == 0.0


def test_stops_where_the_goal_is_confirmed(policy):
    seen = [(1, HYDRANT, 1.3, 0.0), (2, CONE, 0.5, 3.0)]
    choice = decide(policy, belief_of([1] * 10, [2] * 10, seen))
    assert choice.kind is Kind.STOP
    assert choice.confirmed == pytest.approx(1.0)


def test_does_not_stop_while_the_landmark_is_only_imagined(policy):
    seen = [(1, HYDRANT, 1.4, 0.0)]
    choice = decide(policy, belief_of([1] * 10, [(0.5, 3.0)] * 10, seen))
    assert choice.kind is Kind.HYPOTHESISED


def test_does_not_stop_on_a_coin_flip(policy):
    seen = [(1, HYDRANT, 1.3, 0.0), (2, CONE, 0.5, 3.0)]
    figures = [1] * 5 + [(9.0, 5.0)] * 5
    choice = decide(policy, belief_of(figures, [2] * 10, seen))
    assert choice.kind is not Kind.STOP


def test_approaches_what_is_confirmed_and_faces_it(policy):
    seen = [(1, HYDRANT, 6.0, 2.0), (2, CONE, 4.0, 1.0)]
    choice = decide(policy, belief_of([1] * 10, [2] * 10, seen))
    x, y, yaw = choice.candidates.pose[choice.chosen]
    assert choice.kind is Kind.OBSERVED
    assert np.hypot(x - 6.0, y - 2.0) == pytest.approx(places.stand_off + 0.2, abs=0.05)
    assert yaw == pytest.approx(np.arctan2(2.0 - y, 6.0 - x))


def test_a_hypothesis_is_looked_at_from_a_distance_and_in_the_field_of_view(policy):
    choice = decide(policy, belief_of([(12.0, 0.0)] * 10, [(10.0, 0.0)] * 10))
    x, y, yaw = choice.candidates.pose[choice.chosen]
    assert choice.kind is Kind.HYPOTHESISED
    nearest = np.hypot(np.array([10.0, 12.0]) - x, -y).min()
    assert 2.5 <= nearest <= 7.0
    assert abs(np.arctan2(-y, 11.0 - x) - yaw) < HUSKY.camera.horizontal_fov / 2


def test_turns_in_place_for_what_is_near_but_behind(policy):
    choice = decide(policy, belief_of([(-4.0, 0.5)] * 10, [(-3.0, 0.0)] * 10))
    pose = choice.candidates.pose[choice.chosen]
    assert np.hypot(pose[0], pose[1]) < 0.1
    assert abs(pose[2]) > 2.0


def test_does_not_look_again_where_everything_was_looked_at(policy):
    belief = belief_of([(5.0, 0.0)] * 10, [(4.0, 0.0)] * 10)
    choice = decide(policy, belief, grid=grid_of(looked=-6.0))
    assert choice.is_idle


@pytest.mark.parametrize(("share", "confirms"), [(0.75, True), (0.4, False)])
def test_where_nothing_is_left_to_look_at_doubt_is_that_of_a_long_search(policy, share, confirms):
    known = round(20 * share)
    belief = belief_of(
        [1] * known + [(5.0, 0.0)] * (20 - known), [2] * known + [(4.0, 0.0)] * (20 - known),
        seen=((1, HYDRANT, 1.0, 0.0), (2, CONE, 1.5, 0.0)),
    )  # fmt: skip
    proposal = policy.propose(belief, from_figures(belief), grid_of(), HERE, NOTHING_DONE)
    nothing = proposal.features.copy()
    for name in ("see_figure", "see_either", "new_area", "new_area_nothing", "reach"):
        nothing[:, :, names.index(name)] = 0.0
    left = replace(proposal, features=nothing)
    choice = policy.choose(left, from_figures(belief), NOTHING_DONE)
    assert choice.confirms == confirms
    assert choice.is_idle != confirms


def test_refused_places_are_not_proposed_again(policy):
    belief = belief_of([(12.0, 0.0)] * 10, [(10.0, 0.0)] * 10)
    first = decide(policy, belief)
    place = first.candidates.pose[first.chosen, :2]
    again = decide(policy, belief, memory=Memory(place[None], np.zeros((0, 3)), None, 0.0))
    apart = np.hypot(*(again.candidates.pose[1:, :2] - place).T)
    assert apart.min() > 0.6


def test_things_behind_a_wide_wall_are_not_seen_through_it(policy):
    wall = (slice(100, 200), slice(165, 168))  # x = 3 m, 20 m long.
    belief = belief_of([(5.0, 0.0)] * 10, [(4.5, 0.0)] * 10)
    through = decide(policy, belief, grid=grid_of(occupied=wall))
    here = np.hypot(*through.candidates.pose[:, :2].T) < 0.1
    assert through.gains[here].max() < 0.1
    assert decide(policy, belief).gains[0:].max() > 0.5


def test_moments_are_mean_and_variance_of_the_readings():
    phi = np.random.default_rng(0).random((3, 50, 4))
    p = np.random.default_rng(1).random(50)
    p /= p.sum()
    moments = moments_of(phi, p, 2)
    mean = (p[:, None] * phi).sum(axis=1)
    np.testing.assert_allclose(moments[:, 0], mean)
    np.testing.assert_allclose(moments[:, 1], (p[:, None] * phi**2).sum(axis=1) - mean**2)


def behaviors_of(
    belief: MapBelief, node, landmark, probability: float, stamp_ns: int = 5, relation: str = "back"
):
    count = len(belief.weights)
    return Behaviors(
        stamp_ns=stamp_ns,
        instruction_id="i",
        particle=np.arange(count, dtype=np.int32),
        node=np.full(count, node, np.int32),
        landmark=np.full(count, landmark, np.int32),
        probability=np.full(count, probability),
        nothing_fits=np.full(count, 1 - probability),
        action="navigate",
        mode="unknown",
        relation=relation,
        comparative=False,
    )


def test_referents_are_a_distribution_whoever_grounds_them():
    belief = belief_of([1] * 4, [2] * 4, [(1, HYDRANT, 4.0, 0.0), (2, CONE, 3.0, 0.0)])
    for referents in (
        from_figures(belief),
        from_behaviors(belief, behaviors_of(belief, 1, 2, 0.3)),
    ):
        assert referents.probability.sum() == pytest.approx(1.0)
        assert (referents.probability >= 0).all()


def test_what_nothing_fits_is_not_confirmed(policy):
    belief = belief_of([1] * 4, [2] * 4, [(1, HYDRANT, 1.4, 0.0), (2, CONE, 0.5, 3.0)])
    referents = from_behaviors(belief, behaviors_of(belief, 1, 2, 0.02))
    assert policy.goal_of(referents, NOTHING_DONE) is None
    choice = policy.decide(belief, referents, grid_of(), HERE, NOTHING_DONE)
    assert choice.kind is not Kind.STOP


def test_behaviours_of_another_belief_are_refused():
    belief = belief_of([1], [2], [(1, HYDRANT, 1.4, 0.0), (2, CONE, 0.5, 3.0)])
    with pytest.raises(ValueError, match="do not go with the belief"):
        from_behaviors(belief, behaviors_of(belief, 1, 2, 0.9, stamp_ns=6))


def test_weights_may_only_name_features_that_exist(monkeypatch, tmp_path):
    folder = tmp_path / "weights"
    folder.mkdir()
    known = load_rule("husky")
    text = '{"source": "", "mean": {"see_figur": 1}, "variance": {}, "start_m": 2, '
    text += f'"turn_m_per_rad": 0, "tried_factor": 1, "least_gain": {known.least_gain}, '
    (folder / "odd.json").write_text(
        text
        + '"confirmed": 0.9, "confirmed_late": 0.6, "late_s": [60, 150], "confirmed_still": 0.9}'
    )
    monkeypatch.setattr("services.policy.rule.resources.files", lambda _: tmp_path)
    with pytest.raises(UnknownFeatureError, match="see_either"):
        load_rule("odd")


def test_a_goal_that_was_walled_in_meanwhile_is_dropped(policy):
    belief = belief_of(*scattered())
    first = decide(policy, belief)
    current = first.candidates.take(np.array([first.chosen], np.int32))
    x, y = current.pose[0, :2]
    row, column = int((y + 30) / 0.2), int((x + 30) / 0.2)
    wall = (slice(row - 5, row + 6), slice(column - 5, column + 6))
    again = decide(
        policy,
        belief,
        grid=grid_of(occupied=wall),
        memory=Memory(NOTHING_DONE.refused, NOTHING_DONE.tried, current, 0.0),
    )
    assert np.isfinite(again.costs).all()
    assert not again.kept


def test_behaviours_that_contradict_their_hypothesis_count_little():
    seen = [(1, HYDRANT, 5.0, 0.0), (2, CONE, 3.0, 0.0), (3, HYDRANT, 5.0, 4.0)]
    belief = belief_of([1] * 4, [2] * 4, seen)
    other = from_behaviors(belief, behaviors_of(belief, 3, 2, 0.5))
    own = from_behaviors(belief, behaviors_of(belief, 1, 2, 0.5))
    assert mass_of(own, 1) > 0.85
    assert mass_of(other, 3) == pytest.approx(0.5)


def test_a_long_search_settles_for_less_certainty():
    rule = load_rule("husky")
    gates = [
        rule.gate(Circumstances(s, "any", following=False)) for s in (0, 60, 90, 120, 150, 300)
    ]
    assert gates == sorted(gates, reverse=True)
    assert gates[0] == rule.confirmed
    assert gates[-1] == rule.confirmed_late > 0.5


def test_a_small_doubt_about_the_goal_starts_no_new_search():
    chair = BeliefPolicy(get_robot("wheelchair"), load_rule("wheelchair"))
    belief = belief_of([1] * 4, [2] * 4, [(1, HYDRANT, 5.0, 0.0), (2, CONE, 3.0, 0.0)])
    doubted = from_behaviors(belief, behaviors_of(belief, 1, 2, 0.1))
    elsewhere, there = np.array([5.0, 6.0]), np.array([5.5, 0.5])
    assert chair.goal_of(doubted, NOTHING_DONE) is None
    assert chair.goal_of(doubted, replace(NOTHING_DONE, settled=elsewhere)) is None
    assert chair.goal_of(doubted, replace(NOTHING_DONE, settled=there)) == 1
    refuted = from_behaviors(belief, behaviors_of(belief, 1, 2, 0.02))
    assert chair.goal_of(refuted, replace(NOTHING_DONE, settled=there)) is None


def test_words_without_a_relation_are_met_by_the_first_one_seen():
    seen = [(1, HYDRANT, 5.0, 0.0), (3, HYDRANT, 5.0, 4.0)]
    belief = belief_of([1, 3, (9.0, 9.0), 1], [-1] * 4, seen)
    referents = from_behaviors(belief, behaviors_of(belief, 1, -1, 0.5, relation="unknown"))
    assert mass_of(referents, 1) > 0.85


def test_a_doubtful_thing_is_visited_once_and_not_from_all_sides(policy):
    seen = [(1, HYDRANT, 4.0, 0.0), (2, CONE, 3.0, 0.0)]
    belief = belief_of([1] * 5 + [(20.0, 9.0)] * 5, [2] * 10, seen)
    visit = np.array([[2.6, 0.0, 0.0]])
    before = decide(policy, belief)
    after = decide(policy, belief, memory=Memory(np.zeros((0, 2)), visit, None, 0.0))
    worth = [
        max(g for g, k in zip(c.gains, c.candidates.kinds, strict=True) if k is Kind.OBSERVED)
        for c in (before, after)
    ]
    assert worth[1] < 0.5 * worth[0]
