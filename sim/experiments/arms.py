"""Other ways to run the robot, to compare with: the same nodes, one part of them changed.

An arm is a row of `ARMS`: which processes have another node, and what makes it. Nothing of this is
a setting of the nodes themselves: a robot cannot be run as any arm but the first.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from robots.catalogue import get_robot, robot_of
from schemas.arrays import Floats
from schemas.geometry import Pose2
from schemas.language import Annotations
from schemas.run import RunConfig
from services.mapping.filter import SemanticFilter
from services.mapping.node import MappingNode
from services.policy.node import PolicyNode
from services.policy.policy import BeliefPolicy
from services.policy.rule import load_rule
from services.process_table import Process
from services.runtime.node import Node, node_generator
from sim.experiments.ablations import (
    FilterWithoutAbsence,
    FilterWithoutAbsentLandmarks,
    UnconfirmedPolicy,
    policy_with,
    weights_with,
)
from sim.experiments.frontier_policy import FrontierPolicyNode
from sim.experiments.one_hypothesis import OneHypothesis
from sim.experiments.pomcp_policy import PomcpPolicy
from sim.experiments.reference_driver import ReferenceDriverNode
from sim.experiments.reference_path import reference_path
from sim.experiments.true_map import TrueMapNode
from sim.experiments.without_language import ClassAlone, MapWithoutWords
from sim.oracle import Oracle
from sim.scenes.object_relative import STOP_SHORT
from sim.world import make_world

Arm = Literal[
    "ours", "known", "without_language", "frontier", "map_particle", "rate_rule", "pomcp",
    "no_confirmation", "no_negative_evidence", "no_negative_landmark", "one_moment",
    "three_moments",
]  # fmt: skip
Nodes = Mapping[Process, Node]
Meaning = Callable[[Annotations], tuple[str, ...]]
"""Ids of the objects that an understood instruction really means."""

_margin = 0.05
"""Of the reference path beyond the footprint's circle, because a base cuts corners [m]."""
_door_margin = 0.23
"""The same for a base that is longer than its ways are wide [m]."""


@dataclass(frozen=True)
class Truthful:
    """Ground truth that `known` may see."""

    world_from_base: Callable[[], Pose2]
    """The robot's true pose now."""
    meaning: Meaning


Make = Callable[[RunConfig, Truthful], Node]


def nodes_of(arm: Arm, nodes: Nodes, run: RunConfig, truth: Truthful) -> Nodes:
    """The nodes of the process table with those of the arm in their places."""
    for name, make in ARMS[arm].items():
        nodes = _with(nodes, name, make(run, truth))
    return nodes


def _with(nodes: Nodes, name: str, node: Node) -> Nodes:
    """The same nodes, in the same order, with another one in the named place."""
    return {
        _row_for(process, node) if process.name == name else process: (
            node if process.name == name else before
        )
        for process, before in nodes.items()
    }


def _row_for(process: Process, node: Node) -> Process:
    path = f"{type(node).__module__}:{type(node).__name__}"
    return replace(process, node=path, listens=tuple(node.handlers()))


def _true_map(run: RunConfig, truth: Truthful) -> Node:
    return TrueMapNode(run, truth.world_from_base, truth.meaning)


def _reference_driver(run: RunConfig, truth: Truthful) -> Node:
    spec = get_robot(run.robot)
    if spec.arm:
        # A shortest path ends before the arm begins: its own policy drives on the true map.
        return PolicyNode(run, node_generator(run, "policy"))
    return ReferenceDriverNode(
        spec, truth.world_from_base, lambda heard: _reference(run, truth, heard)
    )


def _reference(run: RunConfig, truth: Truthful, heard: Annotations) -> Floats | None:
    """The reference path to the first thing that is meant."""
    meant = truth.meaning(heard)
    if not meant:
        return None
    world, body = make_world(run.world, run.seed), get_robot(run.robot).base
    oracle, start = Oracle(world, body, truth.world_from_base), world.world_from_start
    others = oracle.obstacles(meant[0])
    radius = body.passage_radius + (_margin if body.turns_anywhere else _door_margin)
    # One stops beside a thing, and in the middle of a place.
    short = 0.0 if meant[0] in oracle.places else STOP_SHORT
    end = oracle.middle_of(meant[0])
    return reference_path((start.x, start.y), end, others, radius, short, run.seed)


def _mapping(run: RunConfig, filter_class: type[SemanticFilter]) -> Node:
    return MappingNode(run, node_generator(run, "mapping"), filter_class)


def _policy(run: RunConfig, policy: BeliefPolicy) -> Node:
    return PolicyNode(run, node_generator(run, "policy"), policy)


def _rule(run: RunConfig, truth: Truthful) -> Node:
    del truth
    return _policy(run, BeliefPolicy(robot_of(run), load_rule(run.robot)))


ARMS: Mapping[Arm, Mapping[str, Make]] = {
    "ours": {},
    # The true map in place of the filter, and the shortest path that RRT* finds on it.
    "known": {"mapping": _true_map, "policy": _reference_driver},
    # The filter hears no words, and what is meant is inferred from the class alone. The learned
    # cost never met such beliefs, so that the rule serves this arm better, and the next but one.
    "without_language": {
        "mapping": lambda run, _: MapWithoutWords(run),
        "grounding": lambda run, _: ClassAlone(run),
        "policy": _rule,
    },
    # The nearest place nobody has looked at, until something of the class is seen.
    "frontier": {
        "mapping": lambda run, _: MapWithoutWords(run),
        "policy": lambda run, _: FrontierPolicyNode(robot_of(run)),
    },
    # Everybody believes the likeliest hypothesis and no other.
    "map_particle": {"mapping": lambda run, _: OneHypothesis(run), "policy": _rule},
    # A cost set by hand in place of the learned one.
    "rate_rule": {"policy": _rule},
    # Monte Carlo tree search in place of a cost.
    "pomcp": {"policy": lambda run, _: _policy(run, PomcpPolicy.of(run))},
    # A landmark that is imagined is as good as one that was seen, as in the paper.
    "no_confirmation": {"policy": lambda run, _: _policy(run, UnconfirmedPolicy.of(run))},
    # The filter does not learn from looking where nothing is.
    "no_negative_evidence": {"mapping": lambda run, _: _mapping(run, FilterWithoutAbsence)},
    # It does so for what is wanted, but not for landmarks.
    "no_negative_landmark": {"mapping": lambda run, _: _mapping(run, FilterWithoutAbsentLandmarks)},
    # The learned cost reads another number of moments.
    "one_moment": {"policy": lambda run, _: _policy(run, policy_with(run, 1))},
    "three_moments": {"policy": lambda run, _: _policy(run, policy_with(run, 3))},
}
BASELINES: tuple[Arm, ...] = (
    "known", "without_language", "frontier", "map_particle", "rate_rule", "pomcp",
)  # fmt: skip
MOMENTS: Mapping[Arm, int] = {"one_moment": 1, "three_moments": 3}
"""K of the arms that differ in nothing else; ours has two."""
ABLATIONS: tuple[Arm, ...] = (
    "no_confirmation", "no_negative_evidence", "no_negative_landmark", *MOMENTS,
)  # fmt: skip


def trained(arms: Sequence[Arm], robot: str) -> tuple[Arm, ...]:
    """The arms that can be run: weights with another K may not have been learned yet."""
    return tuple(
        arm for arm in arms if arm not in MOMENTS or weights_with(robot, MOMENTS[arm]).exists()
    )
