"""Every arm takes out the part that its name says, and leaves the rest alone."""

import math

import msgspec
import numpy as np
import pytest

from robots.catalogue import robot_of
from schemas.belief import MapBelief
from schemas.errors import UserError
from schemas.geometry import Pose2
from services.mapping.filter import SemanticFilter
from services.mapping.target import missed
from services.policy.policy import Memory
from services.policy.referents import Referents
from sim.experiments.ablations import (
    FilterWithoutAbsence,
    FilterWithoutAbsentLandmarks,
    UnconfirmedPolicy,
    policy_with,
)
from sim.experiments.arms import MOMENTS
from sim.experiments.one_hypothesis import likeliest
from tests.unit.test_montecarlo_arms import RUN, true_map

PLACES = np.array([[1.0, 0.0]])


def looked_around(filter_class: type[SemanticFilter]) -> SemanticFilter:
    """A filter whose grid says that nothing is within 3 m."""
    robot = robot_of(RUN)
    made = filter_class(robot.symbols, robot.camera, 5, np.random.default_rng(0))
    window, _, _ = made.grid.around(Pose2(0.0, 0.0, 0.0), 3.0)
    made.grid.looked[window] = math.log(0.01)
    return made


@pytest.mark.parametrize(
    ("filter_class", "figure", "landmark"),
    [
        (SemanticFilter, 0.01, 0.01),
        (FilterWithoutAbsence, 1.0, 1.0),
        (FilterWithoutAbsentLandmarks, 0.01, 1.0),
    ],
)
def test_absence_is_evidence_as_far_as_the_arm_has_it(
    filter_class: type[SemanticFilter], figure: float, landmark: float
) -> None:
    evidence = looked_around(filter_class).evidence
    assert np.exp(missed(PLACES, None, evidence)) == pytest.approx([figure])
    assert np.exp(missed(PLACES, None, evidence.for_landmarks)) == pytest.approx([landmark])


def test_without_confirmation_a_seen_figure_is_enough() -> None:
    unconfirmed = Referents(
        probability=np.array([1.0, 0.0]),
        known=np.array([True, False]),
        figure=np.zeros((2, 2)),
        figure_id=np.array([3, -1], np.int32),
        figure_seen=np.array([True, False]),
        figure_existence=np.ones(2),
        figure_size=np.ones(2),
        figure_away=np.ones(2),
        landmark=np.zeros((2, 2)),
        landmark_seen=np.array([False, False]),
        landmark_existence=np.ones(2),
        landmark_id=np.array([4, -1], np.int32),
    )
    policy = UnconfirmedPolicy.of(RUN)
    start = Memory(np.zeros((0, 2)), np.zeros((0, 3)), None, 0.0)
    assert policy.goal_of(unconfirmed, start) == 3
    assert super(UnconfirmedPolicy, policy).goal_of(unconfirmed, start) is None


def belief_of(x: list[float], weights: list[float]) -> MapBelief:
    """Hypotheses that imagine one figure each, at these places, beside what was really seen."""
    _, truth = true_map()
    count, none = len(x), np.full(len(x), -1, np.int32)

    def column(seen: np.ndarray, imagined: np.ndarray) -> np.ndarray:
        return np.concatenate([seen, imagined]).astype(seen.dtype)

    return msgspec.structs.replace(
        truth,
        weights=np.array(weights),
        particle=column(truth.particle, np.arange(count)),
        node=column(truth.node, np.full(count, 1000)),
        class_index=column(truth.class_index, np.zeros(count)),
        class_probability=column(truth.class_probability, np.ones(count)),
        position=column(truth.position, np.column_stack([x, np.zeros(count)])),
        covariance=column(truth.covariance, np.tile(np.eye(2), (count, 1, 1))),
        extent=column(truth.extent, np.ones((count, 3))),
        existence=column(truth.existence, np.ones(count)),
        figure=np.full(count, 1000, np.int32),
        landmark=none,
        figure_class=np.zeros(count, np.int32),
        landmark_class=none,
        topology=np.zeros(count, np.int32),
    )


def test_the_likeliest_hypothesis_is_the_one_with_the_most_weight_around_it() -> None:
    belief = belief_of([0.0, 9.0, 9.3, 9.6], [0.3, 0.2, 0.25, 0.25])
    one = likeliest(belief)
    assert one.weights.tolist() == [1.0]
    assert one.position[one.particle == 0].tolist() == [[9.3, 0.0]]
    assert np.array_equal(one.position[one.seen], belief.position[belief.seen])


def test_which_hypothesis_is_likeliest_does_not_depend_on_their_order() -> None:
    x, weights = [0.0, 9.0, 9.3, 9.6], [0.3, 0.2, 0.25, 0.25]
    one, other = likeliest(belief_of(x, weights)), likeliest(belief_of(x[::-1], weights[::-1]))
    assert np.array_equal(one.position, other.position)


@pytest.mark.parametrize("moments", MOMENTS.values())
def test_without_weights_for_another_k_the_way_to_them_is_told(moments: int) -> None:
    lost = msgspec.structs.replace(RUN, robot="wheelchair")
    with pytest.raises(UserError, match=f"--robot wheelchair --moments {moments}"):
        policy_with(lost, moments)
