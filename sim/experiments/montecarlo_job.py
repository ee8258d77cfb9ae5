"""What one episode of many is asked, and what became of it."""

import math
from dataclasses import dataclass

from msgspec import Struct

from schemas.task import Failure
from sim.experiments.arms import Arm
from sim.experiments.perception_model import PerceptionSettings
from sim.scenes.object_relative import GOAL

PARTICLES = 100


class Scenario(Struct, frozen=True, kw_only=True):
    """One row of a table: what is asked for in which kind of world, and how far the robot sees."""

    name: str
    world: str
    text: str
    view_range_m: float
    """0 is the robot's own camera."""
    view_fov_rad: float = 2 * math.pi
    """The paper names a range alone: it sees all round."""
    robot: str = "husky"
    goal: str = GOAL
    """Id of what is meant."""
    answers: bool = False
    """Whether a simulated person answers the robot's first question."""


@dataclass(frozen=True)
class Job:
    """One episode to be run."""

    scenario: Scenario
    arm: Arm
    seed: int
    perception: PerceptionSettings
    particles: int = PARTICLES


class Result(Struct, frozen=True, kw_only=True):
    """What became of it."""

    scenario: str
    arm: Arm
    seed: int
    success: bool
    at_class: bool
    """Whether the robot declared the goal reached beside any object of the goal's class."""
    failure: Failure | None
    distance_m: float
    shortest_m: float
    time_s: float
    decisions: int
    log_sha256: str
    questions: int = 0
    """How many the robot asked."""

    @property
    def path_efficiency(self) -> float:
        """Success weighted by path length (Anderson et al., 2018)."""
        longest = max(self.distance_m, self.shortest_m, 1e-9)
        return self.shortest_m / longest if self.success else 0.0
