"""One goal at a time: plan, follow, turn, and get out of trouble.

FOLLOWING --at the end of the path--> TURNING --facing--> succeeded
FOLLOWING, TURNING --no progress--> BACKING --after two seconds--> FOLLOWING
no progress for the fourth time, or no path in several grids --> failed
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from robots.spec import RobotSpec
from schemas.belief import OccupancyGrid
from schemas.geometry import Pose2, wrap_angle
from schemas.sensing import LaserScan, Odometry
from schemas.task import Goal, GoalStatus, TaskState
from services.navigation.costmap import Room
from services.navigation.follower import Velocity, follow, length_of, standstill, turn
from services.navigation.obstacle_stop import allowed, obstacles_base, turning
from services.navigation.progress import ProgressWatch
from services.navigation.route import Route

stale_s = 0.5
"""Older odometry or scans move nothing [s]."""

_yaw_tolerance = 0.08
_end_of_path = 0.1
_report_ns = 500_000_000
_backing_s = 2.0
_backing = Velocity(-0.25, 0.0)
_recoveries = 3


class Phase(Enum):
    """What the navigator does about its goal."""

    FOLLOWING = "following"
    TURNING = "turning"
    BACKING = "backing"


@dataclass(frozen=True)
class Step:
    """What one control step asks for."""

    velocity: Velocity | None
    """None when the base is nobody's business now."""
    status: GoalStatus | None


class Navigator:
    """Drives the base to goals. Time is that of the odometry."""

    def __init__(self, spec: RobotSpec) -> None:
        self._spec = spec
        self._route: Route | None = None
        self._grid: OccupancyGrid | None = None
        self._scan: LaserScan | None = None
        self._map_from_odom: Pose2 | None = None
        self._stopped = False
        self._watch = ProgressWatch()
        self._finished: set[str] = set()
        self._begin(None)

    def take_goal(self, goal: Goal) -> None:
        """Replace the goal, unless this very goal is known already."""
        if goal.id in self._finished or (self._route and self._route.goal.id == goal.id):
            return
        self._begin(Route(goal, Room.of(self._spec.base)))

    def take_finished(self, goal_id: str) -> None:
        """Never start this goal again: it ended before the process was restarted."""
        self._finished.add(goal_id)

    def take_grid(self, grid: OccupancyGrid) -> None:
        """Use a newer grid."""
        self._grid = grid

    def take_scan(self, scan: LaserScan) -> None:
        """Use a newer scan."""
        self._scan = scan

    def take_localisation(self, map_from_odom: Pose2) -> None:
        """Use a newer correction of the drift."""
        self._map_from_odom = map_from_odom

    def take_stop(self, stopped: bool) -> None:
        """Hold still, or go on with the same goal."""
        self._stopped = stopped
        self._watch.restart()

    def step(self, odometry: Odometry) -> Step:
        """One control step: where are we, what next, and is the way clear."""
        if self._route is None:
            return Step(standstill if self._stopped else None, None)
        if self._map_from_odom is None or self._grid is None:
            return Step(standstill, None)
        pose = self._map_from_odom @ odometry.odom_from_base
        if self._stopped or self._is_stale(odometry):
            self._watch.restart()
            return Step(standstill, self._report(self._route, pose, odometry.stamp_ns))
        return self._drive(self._route, self._grid, pose, odometry.stamp_ns)

    def _begin(self, route: Route | None) -> None:
        self._route = route
        self._phase = Phase.FOLLOWING
        self._backed_ns = 0
        self._recovered = 0
        self._reported_ns = -_report_ns
        self._watch.restart()

    def _is_stale(self, odometry: Odometry) -> bool:
        if self._scan is None:
            return True
        return abs(odometry.stamp_ns - self._scan.stamp_ns) > stale_s * 1e9

    def _drive(self, route: Route, grid: OccupancyGrid, pose: Pose2, stamp_ns: int) -> Step:
        route.update(grid, pose, stamp_ns)
        if self._phase is Phase.FOLLOWING and self._has_arrived(route, pose):
            self._phase = Phase.TURNING
        if self._phase is Phase.TURNING and self._is_facing(route.goal, pose):
            return self._finish(route, TaskState.SUCCEEDED, "arrived", stamp_ns)
        if route.hopeless and self._phase is not Phase.TURNING:
            return self._finish(route, TaskState.FAILED, route.hopeless, stamp_ns)
        if self._is_given_up(route, pose, stamp_ns):
            return self._finish(route, TaskState.FAILED, "blocked", stamp_ns)
        velocity = self._checked(self._wanted(route, pose, stamp_ns))
        return Step(velocity, self._report(route, pose, stamp_ns))

    def _wanted(self, route: Route, pose: Pose2, stamp_ns: int) -> Velocity:
        limits = self._spec.limits
        if self._phase is Phase.BACKING:
            return self._back_up(route, stamp_ns)
        if self._phase is Phase.TURNING:
            return turn(wrap_angle(route.goal.map_from_goal.yaw - pose.yaw), limits)
        if route.path is None:
            return standstill
        return follow(pose, route.path, limits, route.goal.speed_limit)

    def _checked(self, wanted: Velocity) -> Velocity:
        if self._scan is None:
            return standstill
        obstacles, base = obstacles_base(self._scan), self._spec.base
        is_turn = wanted.linear == 0.0 and wanted.angular != 0.0
        check = turning if is_turn and not base.turns_anywhere else allowed
        return check(wanted, obstacles, base, self._spec.limits)

    def _has_arrived(self, route: Route, pose: Pose2) -> bool:
        goal = route.goal.map_from_goal
        gap = float(np.hypot(goal.x - pose.x, goal.y - pose.y))
        if gap <= route.goal.tolerance and not (route.goal.face and route.ends_beside):
            return True
        return route.path is not None and length_of(route.rest(pose)) < _end_of_path

    def _is_facing(self, goal: Goal, pose: Pose2) -> bool:
        return not goal.face or abs(wrap_angle(goal.map_from_goal.yaw - pose.yaw)) < _yaw_tolerance

    def _is_given_up(self, route: Route, pose: Pose2, stamp_ns: int) -> bool:
        """Start to back up when stuck; True when that was tried often enough."""
        if self._phase is Phase.BACKING or not self._watch.is_stuck(pose, stamp_ns):
            return False
        self._phase, self._backed_ns = Phase.BACKING, stamp_ns
        self._recovered += 1
        return self._recovered > _recoveries

    def _back_up(self, route: Route, stamp_ns: int) -> Velocity:
        if stamp_ns - self._backed_ns < _backing_s * 1e9:
            return _backing
        self._phase = Phase.FOLLOWING
        self._watch.restart()
        route.forget()
        return standstill

    def _finish(self, route: Route, state: TaskState, reason: str, stamp_ns: int) -> Step:
        self._finished.add(route.goal.id)
        self._route = None
        path = np.zeros((0, 2))
        return Step(standstill, _status(route.goal, state, reason, path, stamp_ns))

    def _report(self, route: Route, pose: Pose2, stamp_ns: int) -> GoalStatus | None:
        if stamp_ns - self._reported_ns < _report_ns:
            return None
        self._reported_ns = stamp_ns
        reason = "stopped" if self._stopped else self._phase.value
        return _status(route.goal, TaskState.ACTIVE, reason, route.rest(pose), stamp_ns)


def _status(
    goal: Goal, state: TaskState, reason: str, path: np.ndarray, stamp_ns: int
) -> GoalStatus:
    return GoalStatus(
        stamp_ns=stamp_ns, goal_id=goal.id, state=state, reason=reason, path=path.astype(float)
    )
