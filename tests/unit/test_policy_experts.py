"""What the experts advise in situations laid out by hand."""

import numpy as np
import pytest
from msgspec.structs import replace

from robots.husky.spec import HUSKY
from schemas.belief import MapBelief
from schemas.geometry import Pose2
from services.policy.candidates import Kind
from services.policy.policy import BeliefPolicy
from services.policy.referents import from_figures
from services.policy.rule import load_rule
from services.policy.training.experts import (
    Clairvoyant,
    DetectionRate,
    Expert,
    LeastWay,
    Setting,
)
from services.policy.training.truth import TrueWays
from sim.assets.library import make_asset
from sim.scenes.model import World
from sim.world import make_world
from tests.unit.test_policy_decisions import CONE, HYDRANT, NOTHING_DONE, belief_of, grid_of

RULE = load_rule("husky")
WORLD = make_world("two_hydrants_one_cone", 100_000)
GOAL, OTHER, LANDMARK = (
    WORLD.find(name).world_from_object for name in ("hydrant_1", "hydrant_2", "cone_1")
)
UNSEEN = ([(12.0, 0.0)] * 8, [(9.0, 0.0)] * 8)


def xy(pose: Pose2) -> tuple[float, float]:
    return pose.x, pose.y


def beside(pose: Pose2, gap: float) -> Pose2:
    """A pose between an object and the start, facing it."""
    distance, yaw = np.hypot(pose.x, pose.y), np.arctan2(pose.y, pose.x)
    share = 1 - gap / distance
    return Pose2(share * pose.x, share * pose.y, float(yaw))


def setting_of(belief: MapBelief, pose: Pose2) -> Setting:
    policy = BeliefPolicy(HUSKY, RULE)
    proposal = policy.propose(belief, from_figures(belief), grid_of(), pose, NOTHING_DONE)
    return Setting(proposal, belief, pose, NOTHING_DONE)


def truth_at(pose: Pose2, world: World = WORLD, goals=("hydrant_1",)) -> TrueWays:
    return TrueWays(world, goals, HUSKY, lambda: pose)


def seen_all(figure: int) -> MapBelief:
    seen = [
        (1, HYDRANT, *xy(GOAL)),
        (2, HYDRANT, *xy(OTHER)),
        (3, CONE, *xy(LANDMARK)),
    ]
    return belief_of([figure] * 8, [3] * 8, seen)


def experts_at(pose: Pose2) -> list[Expert]:
    truth = truth_at(pose)
    return [Clairvoyant(truth), DetectionRate(truth, RULE), LeastWay(truth)]


def test_ways_on_the_true_map_lead_round_things():
    radius = make_asset("building", WORLD.find("hydrant_1").look).footprint_radius
    assert radius > 1.0
    wall = replace(WORLD.find("cone_1"), label="building", world_from_object=Pose2(5.0, 0.0, 0.0))
    goal = replace(WORLD.find("hydrant_1"), world_from_object=Pose2(20.0, 0.0, 0.0))
    here, world = Pose2(-10.0, 0.0, 0.0), replace(WORLD, objects=(wall, goal))
    truth = truth_at(here, world)
    (around,) = truth.to_goal(here, np.array([[-10.0, 0.0]]))
    assert around > 30.5
    (free,) = truth.to_goal(here, np.array([[20.0, 10.0]]))
    assert free == pytest.approx(10.0, abs=0.5)


def test_places_are_where_they_are_although_the_robot_believes_to_be_elsewhere():
    """The map is off; what counts is where a place of the map is in the world."""
    believed, true = Pose2(1.0, 2.0, 0.3), Pose2(0.0, 0.0, 0.0)
    truth = truth_at(true)
    place = believed.apply(np.array([[3.0, 0.0]]))
    expected = np.hypot(GOAL.x - 3.0, GOAL.y)
    assert truth.to_goal(believed, place)[0] == pytest.approx(expected, rel=0.1)
    assert truth.from_robot(believed, place)[0] == pytest.approx(3.0, abs=0.1)


def test_the_clairvoyant_goes_to_the_goal_that_nobody_has_seen():
    pose = Pose2(0.0, 0.0, 0.0)
    belief = belief_of([xy(GOAL)] * 4 + [xy(OTHER)] * 4, [xy(LANDMARK)] * 8)
    setting = setting_of(belief, pose)
    advice = Clairvoyant(truth_at(pose)).advise(setting)
    end = setting.proposal.candidates.pose[advice.label, :2]
    assert np.hypot(*(end - xy(GOAL))) < np.hypot(*(end - xy(OTHER)))


def test_the_searcher_does_as_the_rule_before_the_goal_was_detected():
    pose = Pose2(0.0, 0.0, 0.0)
    belief = belief_of(*UNSEEN)
    setting = setting_of(belief, pose)
    advice = DetectionRate(truth_at(pose), RULE).advise(setting)
    own = BeliefPolicy(HUSKY, RULE).choose(setting.proposal, from_figures(belief), NOTHING_DONE)
    assert advice.label == own.chosen


@pytest.mark.parametrize("number", [0, 1])
def test_both_go_to_the_goal_once_it_was_detected(number):
    pose = Pose2(0.0, 0.0, 0.0)
    setting = setting_of(seen_all(2), pose)  # The belief takes the other one for the goal.
    advice = experts_at(pose)[number].advise(setting)
    end = setting.proposal.candidates.pose[advice.label, :2]
    assert np.hypot(*(end - xy(GOAL))) < np.hypot(*(end - xy(OTHER)))


@pytest.mark.parametrize("number", [0, 1, 2])
def test_all_stop_at_the_goal(number):
    pose = beside(GOAL, 1.2)
    advice = experts_at(pose)[number].advise(setting_of(seen_all(1), pose))
    assert setting_of(seen_all(1), pose).proposal.candidates.kinds[advice.label] is Kind.STOP
    assert advice.margin[advice.label] == 0
    assert (np.delete(advice.margin, advice.label) == 1).all()


@pytest.mark.parametrize("number", [0, 1, 2])
def test_none_stops_at_another_thing_and_that_is_the_worst_of_all(number):
    pose = beside(OTHER, 1.2)
    setting = setting_of(seen_all(2), pose)
    advice = experts_at(pose)[number].advise(setting)
    kinds = setting.proposal.candidates.kinds
    assert kinds[advice.label] is not Kind.STOP
    assert advice.margin[kinds.index(Kind.STOP)] > 1.0


def test_none_declares_the_goal_where_the_robot_would_declare_something_else():
    pose = beside(GOAL, 1.2)
    setting = setting_of(seen_all(2), pose)
    for expert in experts_at(pose):
        advice = expert.advise(setting)
        assert setting.proposal.candidates.kinds[advice.label] is not Kind.STOP


def test_the_least_way_is_the_one_over_the_belief_and_not_over_the_true_map():
    pose = Pose2(0.0, 0.0, 0.0)
    setting = setting_of(belief_of([(-9.0, 0.0)] * 8, [(-7.0, 0.0)] * 8), pose)
    advice = LeastWay(truth_at(pose)).advise(setting)
    assert setting.proposal.candidates.target[advice.label, 0] < 0
    assert advice.margin[advice.label] == 0


def test_margins_grow_with_the_way_that_is_wasted():
    pose = Pose2(0.0, 0.0, 0.0)
    setting = setting_of(belief_of(*UNSEEN), pose)
    truth = truth_at(pose)
    advice = Clairvoyant(truth).advise(setting)
    ends = setting.proposal.candidates.pose[:, :2]
    way = truth.from_robot(pose, ends) + 1.1 * truth.to_goal(pose, ends)
    moves = np.array([kind is not Kind.STOP for kind in setting.proposal.candidates.kinds])
    order = np.argsort(way[moves])
    assert (np.diff(advice.margin[moves][order]) >= -1e-12).all()
    assert set(advice.margin[moves]) > {0.0, 1.0}
