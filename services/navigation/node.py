"""Navigation as a process: goals in, velocities out."""

from collections.abc import Iterable

import numpy as np

from robots.catalogue import get_robot
from schemas import topics
from schemas.belief import MapBelief, OccupancyGrid
from schemas.motion import BaseCommand, StopLatch
from schemas.run import RunConfig
from schemas.sensing import LaserScan, Odometry
from schemas.task import Goal, GoalStatus, TaskState
from schemas.topics import Handlers, Output
from services.navigation.follower import Velocity
from services.navigation.navigator import Navigator

valid_ms = 250
"""A command outlives a lost successor, not a dead navigator [ms]."""


class NavigationNode:
    """Plans a path to the goal and follows it."""

    def __init__(self, run: RunConfig, rng: np.random.Generator) -> None:
        del rng  # Nothing here is drawn at random.
        self._navigator = Navigator(get_robot(run.robot))

    def handlers(self) -> Handlers:
        """Goals and what is needed to reach them; the odometry sets the pace."""
        return {
            topics.STOP: self.on_stop,
            topics.ODOMETRY: self.on_odometry,
            topics.SCAN: self.on_scan,
            topics.GRID: self.on_grid,
            topics.BELIEF: self.on_belief,
            topics.GOAL: self.on_goal,
        }

    def resume(self) -> Handlers:
        """A goal that has ended is not started again; the last goal itself comes as input."""
        return {topics.GOAL_STATUS: self.on_own_status}

    def on_own_status(self, status: GoalStatus) -> Iterable[Output]:
        """Remember a goal that ended."""
        if status.state is not TaskState.ACTIVE:
            self._navigator.take_finished(status.goal_id)
        return ()

    def on_stop(self, latch: StopLatch) -> Iterable[Output]:
        """Hold still at once."""
        self._navigator.take_stop(latch.stopped)
        return (_command(Velocity(0.0, 0.0), latch.stamp_ns),) if latch.stopped else ()

    def on_goal(self, goal: Goal) -> Iterable[Output]:
        """Go there from the next odometry on."""
        self._navigator.take_goal(goal)
        return ()

    def on_grid(self, grid: OccupancyGrid) -> Iterable[Output]:
        """Plan on it from the next odometry on."""
        self._navigator.take_grid(grid)
        return ()

    def on_belief(self, belief: MapBelief) -> Iterable[Output]:
        """Correct the drift of the odometry."""
        self._navigator.take_localisation(belief.map_from_odom)
        return ()

    def on_scan(self, scan: LaserScan) -> Iterable[Output]:
        """Look out for obstacles."""
        self._navigator.take_scan(scan)
        return ()

    def on_odometry(self, odometry: Odometry) -> Iterable[Output]:
        """One control step."""
        step = self._navigator.step(odometry)
        if step.velocity is not None:
            yield _command(step.velocity, odometry.stamp_ns)
        if step.status is not None:
            yield topics.GOAL_STATUS.of(step.status)


def _command(velocity: Velocity, stamp_ns: int) -> Output:
    return topics.BASE_COMMAND.of(
        BaseCommand(
            stamp_ns=stamp_ns,
            linear=velocity.linear,
            angular=velocity.angular,
            valid_ms=valid_ms,
        )
    )
