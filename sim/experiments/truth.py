"""Judges the end of an instruction by what is really where."""

import math
from dataclasses import dataclass

from robots.catalogue import get_robot
from schemas.language import Annotations, BehaviorSymbol
from schemas.run import RunConfig
from schemas.task import Failure, InstructionStatus, TaskState
from sim.driver import SapienDriver
from sim.oracle import Oracle, OracleError
from sim.world import make_world

REACHED_M = 2.0
"""The base's middle is this near the object's middle when the robot has arrived [m]."""
HOME_M = 1.0
"""What is brought is this near to where the robot started, at most [m]."""
TAKING = ("pick", "retrieve")
COLLISION_M = 0.02
"""A footprint this near an obstacle has touched it [m]."""


@dataclass(frozen=True)
class Verdict:
    """The truth about one run."""

    failure: Failure | None
    final_error_m: float
    """From the robot to the nearest object that was meant, beyond `REACHED_M` or not [m]."""
    shortest_path_m: float


class Truth:
    """Follows the robot and compares where it stopped with what the words mean in this world.

    The words are taken as the grounding read them, whose own accuracy its training report gives;
    which objects satisfy that reading is decided here by true positions alone.
    """

    def __init__(
        self,
        driver: SapienDriver,
        run: RunConfig,
        intended: tuple[str, ...] = (),
        reached_m: float = REACHED_M,
    ) -> None:
        """`intended` are ids that an experiment means, whatever the words would allow."""
        self._driver = driver
        self._intended, self._reached_m = intended, reached_m
        self._oracle = Oracle(
            make_world(run.world, run.seed),
            get_robot(run.robot).base,
            lambda: driver.world_from_base,
        )
        places = self._oracle.places
        self._began_in = {name for name in places if self._oracle.is_at(name, reached_m)}
        self._taken = ""
        self._last = driver.world_from_base
        self.distance_m = 0.0
        self._least_clearance_m = math.inf

    def follow(self) -> None:
        """Note where the robot is; call it with every odometry message."""
        here = self._driver.world_from_base
        moved = math.hypot(here.x - self._last.x, here.y - self._last.y)
        self.distance_m += moved
        self._last = here
        if moved > 0:
            self._least_clearance_m = min(self._least_clearance_m, self._oracle.clearance())

    def judge(self, heard: Annotations | None, status: InstructionStatus | None) -> Verdict:
        """Success, or the first thing that went wrong."""
        meant = self.meant(heard)
        if heard is not None and heard.behaviors:
            self._taken = heard.behaviors[0].action
        if self._taken == "retrieve":
            return self._judge_bringing(meant, status)
        error_m = min((self._oracle.distance_to(name) for name in meant), default=math.inf)
        path_m = min((self._shortest(name) for name in meant), default=0.0)
        failure = self._failure(status, meant)
        return Verdict(failure, error_m if meant else -1.0, path_m)

    def _failure(self, status: InstructionStatus | None, meant: tuple[str, ...]) -> Failure | None:
        if self._least_clearance_m < COLLISION_M:
            return Failure.COLLISION
        if status is None or status.state is TaskState.ACTIVE:
            return Failure.TIMEOUT
        if status.state is not TaskState.SUCCEEDED:
            return status.failure or Failure.FAULT
        if self._taken in TAKING:
            return self._failure_of_taking(meant)
        if any(self._oracle.is_at(name, self._reached_m) for name in meant):
            return None
        return Failure.WRONG_OBJECT if self.within_reach() else Failure.STOPPED_EARLY

    def _judge_bringing(self, meant: tuple[str, ...], status: InstructionStatus | None) -> Verdict:
        """The robot is to be back at where it started, with the thing."""
        path_m = 2 * min((self._shortest(name) for name in meant), default=0.0)
        return Verdict(self._failure(status, meant), self._from_start_m, path_m)

    @property
    def _from_start_m(self) -> float:
        here, start = self._driver.world_from_base, self._oracle.world.world_from_start
        return math.hypot(here.x - start.x, here.y - start.y)

    def _failure_of_taking(self, meant: tuple[str, ...]) -> Failure | None:
        held = self._driver.in_gripper()
        if not held:
            return Failure.GRASP_FAILED
        if not set(held) & set(meant):
            return Failure.WRONG_OBJECT
        away = self._taken == "retrieve" and self._from_start_m > HOME_M
        return Failure.STOPPED_EARLY if away else None

    def meant(self, heard: Annotations | None) -> tuple[str, ...]:
        """Ids of the objects or places that satisfy the best reading of the instruction."""
        if self._intended:
            return self._intended
        if heard is None or not heard.behaviors:
            return ()
        wanted = heard.behaviors[0]
        labels = self._oracle.kinds
        figures = [name for name, label in labels.items() if label == wanted.object]
        landmarks = [name for name, label in labels.items() if label == wanted.landmark]
        if not landmarks:
            return tuple(figures) if wanted.relation == "unknown" else ()
        return tuple(sorted({n for landmark in landmarks for n in self._related(wanted, landmark)}))

    def _related(self, wanted: BehaviorSymbol, landmark: str) -> tuple[str, ...]:
        if landmark in self._oracle.places:
            return self._oracle.adjoining(wanted.object, landmark)
        if wanted.comparative:
            return (self._oracle.nearest(wanted.object, landmark),)
        return self._oracle.satisfying(wanted.object, wanted.relation, landmark)

    def _shortest(self, name: str) -> float:
        try:
            return self._oracle.shortest_path_length(name, stop_at=self._reached_m)
        except OracleError:
            return math.inf

    def within_reach(self) -> tuple[str, ...]:
        """Ids of the objects that the robot stands at, and of the places that it has come to."""
        others = [name for name in self._oracle.kinds if name not in self._began_in]
        return tuple(name for name in others if self._oracle.is_at(name, self._reached_m))
