"""Other ways to run the robot, to compare with: the same nodes, one of them replaced.

`known` has the true map in place of the filter, and drives the shortest path that RRT* finds on it;
`without_language` has a filter that hears no words and is told the class alone; `frontier` goes to
the nearest place nobody has looked at until it sees that class.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Literal, get_args

import msgspec
import numpy as np

from robots.catalogue import get_robot, robot_of
from schemas import topics
from schemas.arrays import Floats
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from schemas.language import Annotations, Instruction
from schemas.perception import Detections
from schemas.run import RunConfig
from schemas.sensing import LaserScan
from schemas.topics import Handlers, Output
from services.grounding.node import GroundingNode
from services.mapping.node import MappingNode
from services.process_table import Process
from services.runtime.node import Node, node_generator
from sim.experiments.frontier_policy import FrontierPolicyNode
from sim.experiments.reference_driver import ReferenceDriverNode
from sim.experiments.reference_path import reference_path
from sim.experiments.true_map import TrueMapNode
from sim.oracle import Oracle
from sim.scenes.hydrant import SECTOR
from sim.scenes.object_relative import ARENA, STOP_SHORT
from sim.world import make_world

Arm = Literal["ours", "known", "without_language", "frontier"]
ARMS: tuple[Arm, ...] = get_args(Arm)

_arena_margin = 1.0
"""The sector of the arena begins this far behind the start [m]."""
_margin = 0.05
"""Of the reference path beyond the footprint's circle, because a base cuts corners [m]."""
_door_margin = 0.15
"""The same for a base that is longer than its ways are wide [m]."""
_surely_looked = -60
"""As `OccupancyGrid.looked`."""

Nodes = Mapping[Process, Node]
Meaning = Callable[[Annotations], tuple[str, ...]]
"""Ids of the objects that an understood instruction really means."""


@dataclass(frozen=True)
class Truthful:
    """Ground truth that `known` may see."""

    world_from_base: Callable[[], Pose2]
    """The robot's true pose now."""
    meaning: Meaning


def nodes_of(arm: Arm, nodes: Nodes, run: RunConfig, truth: Truthful) -> Nodes:
    """The nodes of the process table with those of the arm in their places."""
    if arm == "known":
        mapped = _with(nodes, "mapping", TrueMapNode(run, truth.world_from_base, truth.meaning))
        driver = ReferenceDriverNode(
            get_robot(run.robot), truth.world_from_base, lambda heard: _way(run, truth, heard)
        )
        return _with(mapped, "policy", driver)
    if arm == "without_language":
        deaf = _with(nodes, "mapping", MapWithoutWords(run))
        return _with(deaf, "grounding", ClassAlone(run))
    if arm == "frontier":
        deaf = _with(nodes, "mapping", MapWithoutWords(run))
        return _with(deaf, "policy", FrontierPolicyNode(robot_of(run)))
    return nodes


def _way(run: RunConfig, truth: Truthful, heard: Annotations) -> Floats | None:
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


class MapWithoutWords:
    """The filter without language: it maps what it sees and imagines nothing.

    Its beliefs still carry the instruction's id, so that behaviours are inferred in them. In the
    place of a prior it is told where the experiment's objects may be at all, ahead and within the
    arena; without that, a search of the open plane seldom ends.
    """

    def __init__(self, run: RunConfig) -> None:
        # All hypotheses are alike where nothing is imagined: one is enough.
        alone = msgspec.structs.replace(run, particles=1)
        self._mapping = MappingNode(alone, node_generator(run, "mapping")).handlers()
        self._instruction_id = ""

    def handlers(self) -> Handlers:
        """As mapping, with nothing but the id taken from the annotations."""
        return {
            **self._mapping,
            topics.ANNOTATIONS: self.on_annotations,
            topics.DETECTIONS: self.on_detections,
            topics.SCAN: self.on_scan,
        }

    def on_annotations(self, annotations: Annotations) -> Iterable[Output]:
        """Learn that something was said."""
        self._instruction_id = annotations.instruction_id
        return ()

    def on_detections(self, detections: Detections) -> Iterable[Output]:
        """Beliefs under the instruction's name."""
        for output in self._mapping[topics.DETECTIONS](detections):
            message = output.message
            if isinstance(message, MapBelief):
                message = msgspec.structs.replace(message, instruction_id=self._instruction_id)
            yield Output(output.topic, message)

    def on_scan(self, scan: LaserScan) -> Iterable[Output]:
        """Grids in which nothing is left to look for outside the arena."""
        for output in self._mapping[topics.SCAN](scan):
            message = output.message
            if isinstance(message, OccupancyGrid):
                message = _within_arena(message)
            yield Output(output.topic, message)


def _within_arena(grid: OccupancyGrid) -> OccupancyGrid:
    height, width = grid.occupancy.shape
    x = grid.origin[0] + (np.arange(width) + 0.5) * grid.resolution
    y = grid.origin[1] + (np.arange(height) + 0.5) * grid.resolution
    bearing = np.arctan2(y[:, None], x[None] + _arena_margin)
    inside = (np.abs(bearing) <= SECTOR) & (np.hypot(x[None], y[:, None]) <= ARENA)
    looked = np.where(inside, grid.looked, np.int8(_surely_looked))
    return msgspec.structs.replace(grid, looked=looked)


class ClassAlone:
    """Grounding that understands the whole sentence, but infers behaviours from the class alone."""

    def __init__(self, run: RunConfig) -> None:
        self._full = GroundingNode(run, node_generator(run, "grounding"))
        self._short = GroundingNode(run, node_generator(run, "grounding"))

    def handlers(self) -> Handlers:
        """As grounding."""
        handlers = dict(self._full.handlers())
        handlers[topics.INSTRUCTION] = self.on_instruction
        handlers[topics.BELIEF] = self._short.on_belief
        return handlers

    def on_instruction(self, instruction: Instruction) -> Iterable[Output]:
        """Annotations of the sentence; the rest hears "go to the" and the class."""
        outputs = list(self._full.on_instruction(instruction))
        for output in outputs:
            annotations = output.message
            if isinstance(annotations, Annotations) and annotations.behaviors:
                text = f"go to the {annotations.behaviors[0].object}"
                list(self._short.on_instruction(msgspec.structs.replace(instruction, text=text)))
        return outputs
