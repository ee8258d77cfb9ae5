"""The path to one goal, planned again as the grid grows."""

import numpy as np

from schemas.arrays import Floats
from schemas.belief import OccupancyGrid
from schemas.geometry import Pose2
from schemas.task import Goal
from services.navigation.costmap import Costmap, Room, costmap_of
from services.navigation.follower import nearest_index
from services.navigation.planner import NoPathError, is_blocked, plan

_refresh_s = 2.0
"""A path that is still free is planned again after this time, for better ways [s]."""
_attempts = 4
"""Grids without a path until the goal is given up; a wrong cell may be seen through again."""


class Route:
    """Path of one goal.

    Args:
        goal: where to go.
        room: that the base needs.
    """

    def __init__(self, goal: Goal, room: Room) -> None:
        self.goal = goal
        self.path: Floats | None = None
        """(N, 2), map frame; None before the first plan and while there is none."""
        self.ends_beside = False
        """Whether the path leads to a place beside the goal, where the base has room."""
        self._room = room
        self._grid_ns = -1
        self._planned_ns = 0
        self._failures = 0
        self._error = ""
        self._everywhere = False

    @property
    def hopeless(self) -> str | None:
        """Why the goal was given up, or None."""
        return f"no path: {self._error}" if self._failures >= _attempts else None

    def forget(self) -> None:
        """Plan anew from the same grid, because following the path did not work."""
        self._grid_ns, self.path = -1, None

    def update(self, grid: OccupancyGrid, map_from_base: Pose2, stamp_ns: int) -> None:
        """Plan when the grid is new and the path is missing, blocked or old."""
        if grid.stamp_ns == self._grid_ns:
            return
        self._grid_ns = grid.stamp_ns
        start = np.array([map_from_base.x, map_from_base.y])
        end = np.array([self.goal.map_from_goal.x, self.goal.map_from_goal.y])
        costmap = self._costmap(grid, start, end)
        self.ends_beside = bool(costmap.cramped[costmap.cell(end)])
        fresh = stamp_ns - self._planned_ns < _refresh_s * 1e9
        if self.path is not None and fresh and not is_blocked(costmap, self.path):
            return
        try:
            self.path, self._failures = self._planned(grid, costmap, start, end), 0
        except NoPathError as error:
            self.path, self._error = None, str(error)
            self._failures += 1
        self._planned_ns = stamp_ns

    def _costmap(self, grid: OccupancyGrid, start: Floats, end: Floats) -> Costmap:
        return costmap_of(grid, start, end, self._room, self._everywhere)

    def _planned(self, grid: OccupancyGrid, costmap: Costmap, start: Floats, end: Floats) -> Floats:
        """A path near start and end if there is one, else from now on anywhere."""
        try:
            return plan(costmap, start, end).points
        except NoPathError:
            if self._everywhere:
                raise
        self._everywhere = True
        return plan(self._costmap(grid, start, end), start, end).points

    def rest(self, map_from_base: Pose2) -> Floats:
        """What is left of the path, shape (K, 2)."""
        if self.path is None:
            return np.zeros((0, 2))
        return self.path[nearest_index(map_from_base, self.path) :]
