"""The way to drive when everything is known: RRT* on the full map (Karaman and Frazzoli, 2011)."""

import math
from collections.abc import Sequence

import numpy as np
import shapely
import shapely.ops
from ompl import base, geometric, util
from shapely.geometry.base import BaseGeometry as Outline

from schemas.arrays import Floats

ITERATIONS, MOST_ITERATIONS = 2000, 30000
"""Samples with a path in hand, and without one. A count, not a time, so that one seed gives one
path on every machine."""
_range = 5.0
"""Longest edge of the tree [m]."""
_straight_enough = 1.001
"""The search ends with a path at most this much longer than the straight line."""
_around = 4.0
"""Paths stay within this distance of the box round everything [m]."""

Point = tuple[float, float]


class NoReferencePathError(ValueError):
    """RRT* found no way; the message says from where to where."""


def reference_path(
    start: Point,
    end: Point,
    obstacles: Sequence[Outline],
    radius: float,
    stop_short: float,
    seed: int,
) -> Floats:
    """Corners (N, 2) of a near-shortest path of a disc among obstacles [m].

    Args:
        start: of the middle of the robot.
        end: what to drive to; it is no obstacle itself.
        obstacles: outlines in the same frame. Those that touch the start or the end once they are
            grown by `radius` are left out, as by `sim.oracle.shortest_path`.
        radius: of the disc [m].
        stop_short: the path ends where it first comes this near to `end` [m].
        seed: decides all of the tree.

    Raises:
        NoReferencePathError: there is no path, or none was found.
    """
    blocked = _blocked(start, end, obstacles, radius)
    space = _space(start, end, blocked)
    information = base.SpaceInformation(space)
    validator = _ExactMotions(information, blocked)
    information.setStateValidityChecker(
        lambda state: not bool(shapely.intersects_xy(blocked, *_point(state)))
    )
    information.setMotionValidator(validator)
    information.setup()
    corners = _rrt_star(information, start, end, seed)
    return _cut_short(corners, end, stop_short)


class _ExactMotions(base.MotionValidator):
    """Tests whole edges against the outlines, where OMPL's own would test points along them."""

    def __init__(self, information: base.SpaceInformation, blocked: Outline) -> None:
        super().__init__(information)
        self._blocked = blocked

    def checkMotion(self, s1: base.State, s2: base.State) -> bool:  # noqa: N802
        """Whether the straight line between two states is free."""
        line = shapely.linestrings([_point(s1), _point(s2)])
        return not bool(shapely.intersects(self._blocked, line))


def _blocked(start: Point, end: Point, obstacles: Sequence[Outline], radius: float) -> Outline:
    grown = [outline.buffer(radius) for outline in obstacles]
    ends = shapely.points([start, end])
    free = [area for area in grown if not shapely.intersects(area, ends).any()]
    blocked = shapely.union_all(free)
    shapely.prepare(blocked)
    return blocked


def _space(start: Point, end: Point, blocked: Outline) -> base.RealVectorStateSpace:
    everything = shapely.union_all([blocked, *shapely.points([start, end])])
    low_x, low_y, high_x, high_y = shapely.bounds(everything).tolist()
    bounds = base.RealVectorBounds(2)
    for axis, (low, high) in enumerate(((low_x, high_x), (low_y, high_y))):
        bounds.setLow(axis, low - _around)
        bounds.setHigh(axis, high + _around)
    space = base.RealVectorStateSpace(2)
    space.setBounds(bounds)
    return space


def _rrt_star(information: base.SpaceInformation, start: Point, end: Point, seed: int) -> Floats:
    # OMPL seeds every generator from one of the process, and warns where it is seeded again; that
    # is what makes a path depend on its own seed and not on the paths planned before.
    util.noOutputHandler()
    util.RNG.setSeed(seed + 1)
    length = base.PathLengthOptimizationObjective(information)
    length.setCostThreshold(base.Cost(_straight_enough * float(np.hypot(*np.subtract(end, start)))))
    problem = base.ProblemDefinition(information)
    problem.setStartAndGoalStates(_state(information, start), _state(information, end))
    problem.setOptimizationObjective(length)
    planner = geometric.RRTstar(information)
    planner.setRange(_range)
    planner.setProblemDefinition(problem)
    planner.setup()

    def is_over(iterations: int) -> bool:
        found = math.isfinite(planner.bestCost().value())
        return iterations >= (ITERATIONS if found else MOST_ITERATIONS)

    planner.solve(base.PlannerTerminationCondition(lambda: is_over(planner.numIterations())))
    if not problem.hasExactSolution():
        raise NoReferencePathError(f"no way from {start} to {end} in {MOST_ITERATIONS} samples")
    path = problem.getSolutionPath()
    assert isinstance(path, geometric.PathGeometric)
    geometric.PathSimplifier(information).ropeShortcutPath(path)
    return np.array([_point(state) for state in path.getStates()])


def _state(information: base.SpaceInformation, point: Point) -> base.State:
    state = information.allocState()
    assert isinstance(state, base.RealVectorStateType)
    state[0], state[1] = point
    return state


def _point(state: base.State) -> Point:
    assert isinstance(state, base.RealVectorStateType)
    return state[0], state[1]


def _cut_short(corners: Floats, end: Point, stop_short: float) -> Floats:
    """The polyline up to the first place that is `stop_short` from `end`."""
    line, disc = shapely.LineString(corners), shapely.Point(end).buffer(stop_short, quad_segs=64)
    inside = shapely.intersection(line, disc)
    if shapely.is_empty(inside):
        return corners
    first = shapely.line_locate_point(line, shapely.points(shapely.get_coordinates(inside))).min()
    return shapely.get_coordinates(shapely.ops.substring(line, 0.0, float(first)))
