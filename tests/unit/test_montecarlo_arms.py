"""The arms are fair: each knows what its name says, and no more."""

import math

import msgspec
import numpy as np
import pytest

from robots.catalogue import robot_of
from schemas import topics
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from schemas.language import Annotations, Behaviors, Instruction
from schemas.perception import Detections
from schemas.run import RunConfig
from schemas.sensing import Odometry
from schemas.task import Goal
from services.grounding.node import GroundingNode
from services.mapping.grid import Grid
from services.process_table import PROCESSES, Process, process_named
from services.runtime.node import Node
from sim.experiments.arms import ARMS, Arm, Truthful, nodes_of, trained
from sim.experiments.frontier_policy import FrontierPolicyNode
from sim.experiments.perception_model import ModelledPerception, PerceptionSettings
from sim.experiments.true_map import TrueMapNode
from sim.experiments.without_language import ClassAlone, MapWithoutWords
from sim.world import make_world

RUN = RunConfig(
    world="two_hydrants_one_cone", seed=1, view_range_m=3.0, view_fov_rad=2 * math.pi, particles=5
)
HERE = Pose2(1.0, 0.5, 0.3)
SAID = Instruction(stamp_ns=1, id="a", text="go to the hydrant behind the cone", source="test")


def odometry(stamp_ns: int, pose: Pose2) -> Odometry:
    return Odometry(
        stamp_ns=stamp_ns, odom_from_base=pose, linear=0.0, angular=0.0, variance_per_metre=0.0,
        variance_per_radian=0.0,
    )  # fmt: skip


def heard(said: Instruction = SAID) -> Annotations:
    (output,) = GroundingNode(RUN, np.random.default_rng(0)).on_instruction(said)
    assert isinstance(output.message, Annotations)
    return output.message


def true_map(stamp_ns: int = 0) -> tuple[OccupancyGrid, MapBelief]:
    node = TrueMapNode(RUN, lambda: HERE, lambda annotations: ("hydrant_1",))
    node.on_annotations(heard())
    grid, belief = (output.message for output in node.on_odometry(odometry(stamp_ns, HERE)))
    assert isinstance(grid, OccupancyGrid)
    assert isinstance(belief, MapBelief)
    return grid, belief


def test_the_known_map_is_the_truth() -> None:
    _, belief = true_map()
    placed = make_world(RUN.world, RUN.seed).objects
    names = [belief.classes[index] for index in belief.class_index]
    truth = np.array([(one.world_from_object.x, one.world_from_object.y) for one in placed])
    assert names == [one.label for one in placed]
    assert belief.position == pytest.approx(truth)
    assert placed[int(belief.figure[0])].id == "hydrant_1"
    assert placed[int(belief.landmark[0])].id == "cone_1"
    pose = belief.map_from_base
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((HERE.x, HERE.y, HERE.yaw))


def test_the_known_map_has_nothing_left_to_look_at() -> None:
    grid, belief = true_map()
    assert grid.looked.max() < -50
    cells = np.floor((belief.position - grid.origin) / grid.resolution).astype(int)
    assert (grid.occupancy[cells[:, 1], cells[:, 0]] > 0).all()


def test_a_filter_without_words_imagines_nothing_and_answers_under_the_same_id() -> None:
    node = MapWithoutWords(RUN)
    handlers = node.handlers()
    node.on_annotations(heard())
    empty = msgspec.structs.replace(picture(), stamp_ns=2_000_000_000)
    (output,) = handlers[topics.DETECTIONS](empty)
    belief = output.message
    assert isinstance(belief, MapBelief)
    assert belief.instruction_id == "a"
    assert len(belief.node) == 0
    assert belief.figure.tolist() == [-1]


def picture() -> Detections:
    node = ModelledPerception(
        make_world(RUN.world, RUN.seed), lambda: Pose2(0.0, 0.0, 0.0), robot_of(RUN).camera,
        PerceptionSettings(false_per_picture=0.0), np.random.default_rng(0),
    )  # fmt: skip
    (output,) = node.on_odometry(odometry(0, Pose2(0.0, 0.0, 0.0)))
    assert isinstance(output.message, Detections)
    return output.message


def test_without_language_the_relation_is_heard_but_not_used() -> None:
    node = ClassAlone(RUN)
    (output,) = node.on_instruction(SAID)
    assert isinstance(output.message, Annotations)
    assert output.message.behaviors[0].relation == "back"
    _, belief = true_map()
    (output,) = node.handlers()[topics.BELIEF](belief)
    behaviors = output.message
    assert isinstance(behaviors, Behaviors)
    assert behaviors.relation == "unknown"
    assert set(behaviors.landmark.tolist()) == {-1}


def test_the_frontier_arm_goes_to_the_nearest_of_the_class_once_one_is_seen() -> None:
    node = FrontierPolicyNode(robot_of(RUN))
    grid, belief = true_map(2_000_000_000)
    node.on_odometry(odometry(0, HERE))
    node.on_grid(grid)
    node.on_annotations(heard())
    (output,) = node.on_belief(belief)
    goal = output.message
    assert isinstance(goal, Goal)
    hydrants = belief.position[belief.class_index == belief.classes.index("hydrant")]
    nearest = hydrants[np.argmin(np.hypot(*(hydrants - (HERE.x, HERE.y)).T))]
    gap = math.dist(nearest, (goal.map_from_goal.x, goal.map_from_goal.y))
    assert gap == pytest.approx(1.2, abs=0.1)


def test_the_frontier_arm_starts_with_the_ground_next_to_it() -> None:
    node = FrontierPolicyNode(robot_of(RUN))
    grid = Grid((0.0, 0.0))
    grid.occupancy[:] = -2.0
    inside = np.hypot(*np.indices(grid.looked.shape) - grid.looked.shape[0] / 2) < 15
    grid.looked[inside] = -5.0
    _, belief = true_map(2_000_000_000)
    unseen = msgspec.structs.replace(belief, existence=np.zeros(len(belief.node)))
    node.on_odometry(odometry(0, HERE))
    node.on_grid(grid.message(0))
    node.on_annotations(heard())
    (output,) = node.on_belief(unseen)
    goal = output.message
    assert isinstance(goal, Goal)
    assert math.hypot(goal.map_from_goal.x - HERE.x, goal.map_from_goal.y - HERE.y) < 3.5


@pytest.mark.parametrize("arm", trained(tuple(ARMS), RUN.robot))
def test_an_arm_replaces_nothing_but_what_it_is_about(arm: Arm) -> None:
    nodes: dict[Process, Node] = {process: _Dummy() for process in PROCESSES if process.lockstep}
    truth = Truthful(lambda: HERE, lambda annotations: ())
    changed = nodes_of(arm, nodes, RUN, truth)
    assert [process.name for process in changed] == [process.name for process in nodes]
    kept = {process.name for process, node in changed.items() if isinstance(node, _Dummy)}
    replaced = {
        "ours": set(),
        "known": {"mapping", "policy"},
        "without_language": {"mapping", "grounding", "policy"},
        "frontier": {"mapping", "policy"},
        "map_particle": {"mapping", "policy"},
        "rate_rule": {"policy"},
        "pomcp": {"policy"},
        "no_confirmation": {"policy"},
        "no_negative_evidence": {"mapping"},
        "no_negative_landmark": {"mapping"},
        "one_moment": {"policy"},
        "three_moments": {"policy"},
    }[arm]
    assert {process.name for process in nodes} - kept == replaced
    assert process_named("navigation").name in kept


class _Dummy:
    def handlers(self) -> topics.Handlers:
        return {}
