"""The robot without language: the same nodes, told nothing but the class of what is wanted."""

from collections.abc import Iterable

import msgspec
import numpy as np

from schemas import topics
from schemas.belief import MapBelief, OccupancyGrid
from schemas.language import Annotations, Instruction
from schemas.perception import Detections
from schemas.run import RunConfig
from schemas.sensing import LaserScan
from schemas.topics import Handlers, Output
from services.grounding.node import GroundingNode
from services.mapping.node import MappingNode
from services.runtime.node import node_generator
from sim.scenes.hydrant import SECTOR
from sim.scenes.object_relative import ARENA
from sim.world import make_world

_arena_margin = 1.0
"""The sector of the arena begins this far behind the start [m]."""
_surely_looked = -60
"""As `OccupancyGrid.looked`."""


class MapWithoutWords:
    """The filter without language: it maps what it sees and imagines nothing.

    Its beliefs still carry the instruction's id, so that behaviours are inferred in them. In the
    place of a prior it is told where the experiment's objects may be at all, ahead and within the
    arena; without that, a search of the open plane seldom ends. Between walls it is told nothing.
    """

    def __init__(self, run: RunConfig) -> None:
        # All hypotheses are alike where nothing is imagined: one is enough.
        alone = msgspec.structs.replace(run, particles=1)
        self._mapping = MappingNode(alone, node_generator(run, "mapping")).handlers()
        self._instruction_id = ""
        # Indoors the walls say where there is something left to look for.
        self._in_arena = not make_world(run.world, run.seed).walls

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
            if self._in_arena and isinstance(message, OccupancyGrid):
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
