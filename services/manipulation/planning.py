"""Ways through joint space on which nothing touches: RRT-Connect, then shortcuts."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.random import Generator
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from robots.arm import ArmLimits
from schemas.arrays import Floats
from schemas.task import HandlingFailure
from services.manipulation.collision import ArmCollision
from services.manipulation.errors import RefusalError

STEP = 0.04
"""Between tested points of a way, in the joint that turns most [rad]."""
MOST_CHECKS = 6000
"""Tests of one search. A count, not a time, ends it: the same question gets the same answer."""
_reach = 0.8
"""Length of an edge of the search tree [rad]."""
_room = 1.6
"""How far beyond start and goals the search goes [rad]."""
_shortcuts = 60

ou.setLogLevel(ou.LOG_NONE)


def plan(
    collision: ArmCollision, limits: ArmLimits, start: Floats, goals: Floats, rng: Generator
) -> Floats:
    """A way from a posture to one of several.

    Args:
        collision: what is to be kept from.
        limits: of the joints.
        start: (6,) [rad].
        goals: (K, 6), the better ones first [rad].
        rng: for the search and the shortcuts.

    Returns:
        Corners of the way (N, 6), from start to goal [rad].

    Raises:
        RefusalError: start or goals touch something, or no way was found.
    """
    if reason := collision.touching(start):
        raise RefusalError(HandlingFailure.START_IN_COLLISION, f"where the arm is, {reason}")
    free = np.array([goal for goal in goals if collision.free(goal)])
    if not len(free):
        reason = collision.touching(goals[0])
        raise RefusalError(HandlingFailure.GOAL_IN_COLLISION, f"where it is to go, {reason}")
    free = free[np.argsort(np.abs(free - start).max(axis=1), kind="stable")]
    for goal in free:
        straight = np.stack([start, goal])
        if collision.free_along(dense(straight)):
            return straight
    return _shortened(collision, _search(collision, limits, start, free, rng), rng)


def dense(corners: Floats, step: float = STEP) -> Floats:
    """Points (M, 6) on a way of corners (N, 6), none further than `step` from the next [rad]."""
    pieces = [corners[:1]]
    for a, b in pairwise(corners):
        count = max(1, int(np.ceil(np.abs(b - a).max() / step)))
        pieces.append(a + np.arange(1, count + 1)[:, None] / count * (b - a))
    return np.concatenate(pieces)


def _search(
    collision: ArmCollision, limits: ArmLimits, start: Floats, goals: Floats, rng: Generator
) -> Floats:
    # Planners draw from generators that this seeds when they are made, as often as it is called.
    ou.RNG.setSeed(int(rng.integers(1, 2**31)))
    low = np.maximum(limits.low, np.minimum(start, goals.min(axis=0)) - _room)
    high = np.minimum(limits.high, np.maximum(start, goals.max(axis=0)) + _room)
    space = _space(low, high)
    checks = _Counted(collision.free)
    info = ob.SpaceInformation(space)
    info.setStateValidityChecker(checks)
    info.setStateValidityCheckingResolution(STEP / space.getMaximumExtent())
    info.setup()
    problem = _problem(info, space, start, goals)
    planner = og.RRTConnect(info)
    planner.setRange(_reach)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(ob.PlannerTerminationCondition(lambda: checks.count > MOST_CHECKS))
    if not problem.hasExactSolution():
        raise RefusalError(
            HandlingFailure.NO_PATH,
            f"no way without collision was found in {checks.count} postures that were tried",
        )
    return np.array([_array(state) for state in problem.getSolutionPath().getStates()])


class _Counted:
    """Calls a test of postures and counts."""

    def __init__(self, free: Callable[[Floats], bool]) -> None:
        self._free = free
        self.count = 0

    def __call__(self, state: Any) -> bool:
        self.count += 1
        return self._free(_array(state))


def _array(state: Any) -> Floats:
    return np.array([state[index] for index in range(6)])


def _space(low: Floats, high: Floats) -> Any:
    space = ob.RealVectorStateSpace(6)
    bounds = ob.RealVectorBounds(6)
    for index in range(6):
        bounds.setLow(index, float(low[index]))
        bounds.setHigh(index, float(high[index]))
    space.setBounds(bounds)
    return space


def _problem(info: Any, space: Any, start: Floats, goals: Floats) -> Any:
    problem = ob.ProblemDefinition(info)
    problem.addStartState(_state(space, start))
    wanted = ob.GoalStates(info)
    for goal in goals:
        wanted.addState(_state(space, goal))
    problem.setGoal(wanted)
    return problem


def _state(space: Any, joints: Floats) -> Any:
    state = space.allocState()
    for index in range(6):
        state[index] = float(joints[index])
    return state


def _shortened(collision: ArmCollision, corners: Floats, rng: Generator) -> Floats:
    """Cut off detours between random points of the way, as long as that is free."""
    for _ in range(_shortcuts):
        if len(corners) == 2:
            break
        lengths = np.abs(np.diff(corners, axis=0)).max(axis=1)
        along = np.r_[0.0, np.cumsum(lengths)]
        first, last = np.sort(rng.uniform(0.0, along[-1], 2))
        corners = _cut(collision, corners, along, float(first), float(last))
    return corners


def _cut(
    collision: ArmCollision, corners: Floats, along: Floats, first: float, last: float
) -> Floats:
    i, j = np.searchsorted(along, [first, last], "right")
    if i == j:
        return corners
    ends = np.stack([[np.interp(s, along, column) for column in corners.T] for s in (first, last)])
    if not collision.free_along(dense(ends)):
        return corners
    return np.concatenate([corners[:i], ends, corners[j:]])
