"""The simplest search there is: the nearest unseen ground, until a thing of the class is seen."""

from collections.abc import Iterable

import numpy as np

from robots.spec import RobotSpec
from schemas import topics
from schemas.arrays import Floats
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from schemas.language import Annotations
from schemas.sensing import Odometry
from schemas.task import Failure, Goal, GoalStatus, InstructionStatus, TaskState
from schemas.topics import Handlers, Output
from services.policy import places
from services.policy.candidates import Candidates
from services.policy.terrain import terrain_for, terrain_of
from services.policy.travel import travel_from

TIME_LIMIT_S = 300.0
_seen_above = 0.5
_sure_of_place = 0.9
"""As sure as our policy is of the goal before it stops."""
_refused_within = 0.7
_tolerance = 0.15
_speed_share = 0.8
_patience_s = 20.0
_footprint_margin, _turning_margin = 0.05, 0.15
"""As the policy's [m]."""


class FrontierPolicyNode:
    """Takes the place of the policy."""

    def __init__(self, spec: RobotSpec) -> None:
        self._spec = spec
        self._turning_radius = spec.base.radius + _turning_margin
        self._radius = spec.base.passage_radius + _footprint_margin
        self._heard: Annotations | None = None
        self._grid: OccupancyGrid | None = None
        self._map_from_odom: Pose2 | None = None
        self._odom_from_base: Pose2 | None = None
        self._viewer = Pose2(0.0, 0.0, 0.0)
        self._goal: Goal | None = None
        self._approached = -1
        self._decisions = 0
        self._refused: list[Floats] = []
        self._arrived = False

    def handlers(self) -> Handlers:
        """Of the policy's inputs those that it needs."""
        return {
            topics.ODOMETRY: self.on_odometry,
            topics.ANNOTATIONS: self.on_annotations,
            topics.GRID: self.on_grid,
            topics.BELIEF: self.on_belief,
            topics.GOAL_STATUS: self.on_goal_status,
        }

    def on_odometry(self, odometry: Odometry) -> Iterable[Output]:
        """Know where the robot is."""
        self._odom_from_base = odometry.odom_from_base
        return ()

    def on_annotations(self, annotations: Annotations) -> Iterable[Output]:
        """Take the class from them."""
        self._heard = annotations
        self._viewer = self._pose() or self._viewer
        if not annotations.behaviors:
            return (self._status(annotations.stamp_ns, Failure.NOT_UNDERSTOOD, "no behaviour"),)
        return ()

    def on_grid(self, grid: OccupancyGrid) -> Iterable[Output]:
        """Use it from the next decision on."""
        self._grid = grid
        return ()

    def on_goal_status(self, status: GoalStatus) -> Iterable[Output]:
        """The goal is done with, one way or the other; having come to the thing ends it all."""
        if self._goal is None or status.goal_id != self._goal.id:
            return ()
        if status.state is TaskState.ACTIVE:
            return ()
        pose = self._goal.map_from_goal
        self._refused.append(np.array([pose.x, pose.y]))
        self._goal = None
        self._arrived = self._approached >= 0 and status.state is TaskState.SUCCEEDED
        return (self._status(status.stamp_ns, None, "standing at it"),) if self._arrived else ()

    def on_belief(self, belief: MapBelief) -> Iterable[Output]:
        """Decide when there is no goal, or when the thing has come into sight."""
        self._map_from_odom = belief.map_from_odom
        pose = self._pose()
        heard, grid = self._heard, self._grid
        if heard is None or not heard.behaviors or grid is None or pose is None or self._arrived:
            return
        if belief.stamp_ns - heard.stamp_ns > TIME_LIMIT_S * 1e9:
            self._arrived = True
            yield self._status(belief.stamp_ns, Failure.TIMEOUT, "not found in time")
            return
        sure = _sure_of_place if self._is_place else 0.0
        thing = _nearest_seen(belief, heard.behaviors[0].object, pose, sure)
        if self._goal is not None and not self._is_overdue(belief, thing):
            return
        chosen = self._choose(belief, grid, pose, thing)
        if len(chosen) == 0:
            self._arrived = True
            yield self._status(belief.stamp_ns, Failure.NEVER_FOUND, "nothing is left to look at")
            return
        self._goal = self._goal_of(belief.stamp_ns, chosen)
        yield topics.GOAL.of(self._goal)

    def _is_overdue(self, belief: MapBelief, thing: int) -> bool:
        assert self._goal is not None
        waited_s = (belief.stamp_ns - self._goal.stamp_ns) / 1e9
        return waited_s > _patience_s or (thing >= 0 and self._approached < 0)

    def _choose(
        self, belief: MapBelief, grid: OccupancyGrid, pose: Pose2, thing: int
    ) -> Candidates:
        self._approached = thing
        if thing >= 0:
            row = int(np.flatnonzero(belief.seen & (belief.node == thing))[0])
            if self._is_place:
                terrain = terrain_for(grid, self._radius)
                middle = belief.position[row]
                return places.inside(middle, thing, terrain, self._turning_radius, pose)
            radius = 0.25 * float(belief.extent[row, 0] + belief.extent[row, 1])
            return self._possible(places.approaches(belief.position[row], radius, thing, pose))
        if self._is_place:
            terrain = terrain_for(grid, self._radius)
            ways = travel_from(terrain, np.array([pose.x, pose.y]), self._radius)
            ahead = self._possible(
                places.openings(terrain, pose, self._radius, self._turning_radius)
            )
            # The nearest by the way there, not through the wall.
            order = np.argsort(ways.to(ahead.pose[:, :2]), kind="stable")
            return ahead.take(order.astype(np.int32))
        return self._possible(places.frontiers(terrain_of(grid), pose, self._viewer))

    @property
    def _is_place(self) -> bool:
        """Whether a place is looked for, not a thing."""
        assert self._heard is not None
        return self._heard.behaviors[0].object in self._spec.symbols.locations

    def _possible(self, candidates: Candidates) -> Candidates:
        if not self._refused or not len(candidates):
            return candidates
        gaps = np.linalg.norm(candidates.pose[:, None, :2] - np.array(self._refused), axis=2)
        return candidates.take(np.flatnonzero(gaps.min(axis=1) > _refused_within).astype(np.int32))

    def _goal_of(self, stamp_ns: int, chosen: Candidates) -> Goal:
        assert self._heard is not None
        self._decisions += 1
        x, y, yaw = chosen.pose[0].tolist()
        return Goal(
            stamp_ns=stamp_ns,
            id=f"{self._heard.instruction_id}/{self._decisions}",
            instruction_id=self._heard.instruction_id,
            map_from_goal=Pose2(x, y, yaw),
            tolerance=_tolerance,
            face=self._spec.camera.horizontal_fov < 2 * np.pi,
            speed_limit=self._spec.limits.linear_speed * _speed_share,
        )

    def _status(self, stamp_ns: int, failure: Failure | None, reason: str) -> Output:
        assert self._heard is not None
        return topics.INSTRUCTION_STATUS.of(
            InstructionStatus(
                stamp_ns=stamp_ns,
                instruction_id=self._heard.instruction_id,
                text=self._heard.text,
                state=TaskState.FAILED if failure else TaskState.SUCCEEDED,
                failure=failure,
                reason=reason,
                started_ns=self._heard.stamp_ns,
                decisions=self._decisions,
            )
        )

    def _pose(self) -> Pose2 | None:
        if self._map_from_odom is None or self._odom_from_base is None:
            return None
        return self._map_from_odom @ self._odom_from_base


def _nearest_seen(belief: MapBelief, label: str, pose: Pose2, sure: float) -> int:
    """Id of the nearest seen object of a class, by which it is known this surely; -1 for none."""
    wanted = belief.classes.index(label) if label in belief.classes else -1
    seen = belief.seen & (belief.existence >= _seen_above) & (belief.class_probability >= sure)
    rows = np.flatnonzero(seen & (belief.class_index == wanted))
    gaps = np.hypot(*(belief.position[rows] - (pose.x, pose.y)).T)
    return int(belief.node[rows[np.argmin(gaps)]]) if len(rows) else -1
