import numpy as np
import pytest
from numpy.testing import assert_allclose

from schemas.belief import MapBelief
from schemas.geometry import Pose2
from schemas.task import Decision
from web.belief_model import goal_object, hypothesised, modes, observed

_classes = ("unknown", "cone", "hydrant")
_nowhere = Pose2(0.0, 0.0, 0.0)


def make_belief(
    hydrants: np.ndarray, weights: np.ndarray, order: np.ndarray | None = None
) -> MapBelief:
    """One seen cone at (5, 0) and one guessed hydrant in each hypothesis, which is the figure."""
    count = len(hydrants)
    order = np.arange(count) if order is None else order
    position = np.vstack([[[5.0, 0.0]], hydrants[order]])
    rows = count + 1
    return MapBelief(
        stamp_ns=1,
        instruction_id="i",
        classes=_classes,
        weights=weights[order],
        particle=np.r_[-1, np.arange(count)].astype(np.int32),
        node=np.r_[1, np.full(count, 7)].astype(np.int32),
        class_index=np.r_[1, np.full(count, 2)].astype(np.int32),
        class_probability=np.full(rows, 0.94),
        position=position,
        covariance=np.tile(0.01 * np.eye(2), (rows, 1, 1)),
        extent=np.tile([0.4, 0.4, 0.8], (rows, 1)),
        existence=np.ones(rows),
        figure=np.full(count, 7, np.int32),
        landmark=np.full(count, 1, np.int32),
        figure_class=np.full(count, -1, np.int32),
        landmark_class=np.full(count, -1, np.int32),
        topology=np.zeros(count, np.int32),
        node_regions=np.zeros((0, 1), np.int32),
        region_edges=np.zeros((0, 3), np.int32),
        viewer=_nowhere,
        map_from_odom=_nowhere,
        map_from_base=_nowhere,
        trajectory=np.zeros((1, 3)),
        effective_particles=float(1 / (weights**2).sum()),
    )


@pytest.fixture
def two_places() -> tuple[np.ndarray, np.ndarray]:
    """Three quarters of the mass behind the cone, the rest far to the right."""
    rng = np.random.default_rng(0)
    behind, right = rng.normal((7, 0), 0.3, (30, 2)), rng.normal((5, -9), 0.3, (10, 2))
    weights = np.r_[np.full(30, 0.75 / 30), np.full(10, 0.25 / 10)]
    return np.vstack([behind, right]), weights


def test_heavier_hypotheses_are_drawn_more_solid(two_places):
    belief = make_belief(*two_places)
    drawn = hypothesised(belief)["hydrant"]
    weight_at = {tuple(p): w for p, w in zip(belief.position[1:], belief.weights, strict=True)}
    weights = np.array([weight_at[tuple(p)] for p in drawn.positions[:, :2]])
    assert np.all(np.diff(drawn.opacities[np.argsort(weights)]) >= -1e-12)
    assert np.all((drawn.opacities > 0) & (drawn.opacities <= 1))


def test_guesses_stand_on_the_ground_and_seen_objects_are_not_among_them(two_places):
    drawn = hypothesised(make_belief(*two_places))
    assert set(drawn) == {"hydrant"}
    assert_allclose(drawn["hydrant"].positions[:, 2], 0.4)


def test_of_very_many_hypotheses_the_heaviest_are_drawn():
    rng = np.random.default_rng(1)
    weights = rng.gamma(2.0, 1.0, 400)
    weights /= weights.sum()
    points = rng.normal(0, 3, (400, 2))
    drawn = hypothesised(make_belief(points, weights))["hydrant"]
    heaviest = points[np.sort(np.argsort(-weights)[: len(drawn.positions)])]
    assert len(drawn.positions) < 400
    assert_allclose(drawn.positions[:, :2], heaviest)


def test_masses_of_the_modes_are_the_masses_of_the_places(two_places):
    found = modes(make_belief(*two_places))
    assert [round(mode.mass, 3) for mode in found] == [0.75, 0.25]
    assert_allclose(found[0].mean, (7, 0), atol=0.2)
    assert found[0].name == "hydrant"
    assert not found[0].seen


def test_relabelling_the_particles_changes_no_mode(two_places):
    order = np.random.default_rng(2).permutation(40)
    straight, shuffled = make_belief(*two_places), make_belief(*two_places, order)
    for a, b in zip(modes(straight), modes(shuffled), strict=True):
        assert_allclose((a.mass, *a.mean), (b.mass, *b.mean))
        assert_allclose(a.covariance, b.covariance)


def test_a_figure_that_was_seen_gathers_the_mass_of_all_who_mean_it(two_places):
    belief = make_belief(*two_places)
    figure = np.where(np.arange(40) < 30, 1, 7).astype(np.int32)
    changed = MapBelief(
        **{f: getattr(belief, f) for f in belief.__struct_fields__} | {"figure": figure}
    )
    best = modes(changed)[0]
    assert (best.name, best.seen, round(best.mass, 3)) == ("cone", True, 0.75)


def test_no_figure_is_no_mode(two_places):
    belief = make_belief(*two_places)
    none = np.full(40, -1, np.int32)
    changed = MapBelief(
        **{f: getattr(belief, f) for f in belief.__struct_fields__} | {"figure": none}
    )
    assert modes(changed) == []


def decide(kind: str, target: tuple[float, float]) -> Decision:
    return Decision(
        stamp_ns=1,
        instruction_id="i",
        kinds=(kind,),
        positions=np.array([target]),
        costs=np.zeros(1),
        chosen=0,
        confirmed=0.0,
        reason="",
    )


def test_the_goal_is_where_the_policy_looks_for_it(two_places):
    goal = goal_object(make_belief(*two_places), decide("hypothesised", (5.2, -8.8)))
    assert goal.mode.mass == pytest.approx(0.25)
    assert_allclose(goal.position, (5.2, -8.8))


def test_to_stop_is_about_the_likeliest_object_and_not_about_where_the_robot_stands(two_places):
    belief = make_belief(*two_places)
    goal = goal_object(belief, decide("stop", (5.0, -9.0)))
    assert goal.mode.mass == pytest.approx(0.75)
    assert np.hypot(*(goal.position - (7, 0))) < 1.5


def test_exploring_is_about_no_object(two_places):
    belief = make_belief(*two_places)
    assert goal_object(belief, decide("frontier", (7.0, 0.0))) is None
    assert goal_object(belief, decide("hypothesised", (30.0, 0.0))) is None


def test_objects_that_hardly_exist_are_not_shown(two_places):
    belief = make_belief(*two_places)
    assert [(seen.node, seen.name, seen.probability) for seen in observed(belief)] == [
        (1, "cone", 0.94)
    ]
    faint = np.full(41, 0.05)
    changed = MapBelief(
        **{f: getattr(belief, f) for f in belief.__struct_fields__} | {"existence": faint}
    )
    assert observed(changed) == []
