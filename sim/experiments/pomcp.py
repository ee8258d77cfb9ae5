"""POMCP on the same belief: Monte Carlo tree search over what looking would show.

After Silver and Veness (2010). A state is one reading of the instruction, as in the policy: where
figure and landmark are and which of them were seen. An action is one of the policy's candidates,
an observation whether figure and landmark come into sight there. What a candidate costs is the
mean way, in metres, until the robot stands at the right thing; to declare a wrong one costs
`WRONG_M` more.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator

from schemas.arrays import Flags, Floats, Ints

SIMULATIONS = 400
DEPTH = 8
"""Looks in one simulation."""
WRONG_M = 40.0
"""What it costs to declare a wrong thing found, in metres to drive."""
LOST_M = 25.0
"""What is left to be driven where nothing was found within `DEPTH` looks."""
EXPLORATION_M = 8.0
"""Constant of UCB1: about the spread of the costs."""
WIDTH = 14
"""Actions that are tried in one place, the most promising ones."""

_here = -1


@dataclass(frozen=True)
class SearchProblem:
    """C candidates and M readings as arrays."""

    probability: Floats
    """(M,) Sums to one."""
    way: Floats
    """(C,) From the robot [m]."""
    between: Floats
    """(C, C) From candidate to candidate [m]."""
    see_figure: Floats
    """(C, M) Probability that it comes into sight, if it was not seen yet."""
    see_landmark: Floats
    """(C, M)"""
    figure_seen: Flags
    """(M,)"""
    landmark_seen: Flags
    """(M,) True also where there is none."""
    to_figure: Floats
    """(C, M) From candidate to what is meant [m]."""
    declares: Ints
    """(C,) Object that the robot declares found when it gets there, -1 to look on."""
    figure_id: Ints
    """(M,) What is meant; no object of `declares` where that was not seen."""

    def way_to(self, place: int) -> Floats:
        """(C,) Ways from a candidate, or from the robot [m]."""
        return self.way if place == _here else self.between[place]


@dataclass
class _Node:
    """Statistics of one history of actions and observations."""

    actions: Ints
    visits: Floats = field(init=False)
    costs: Floats = field(init=False)

    def __post_init__(self) -> None:
        self.visits, self.costs = np.zeros(len(self.actions)), np.zeros(len(self.actions))

    def pick(self) -> int:
        """Row by UCB1 for costs: untried ones first, in order."""
        untried = np.flatnonzero(self.visits == 0)
        if len(untried):
            return int(untried[0])
        bonus = EXPLORATION_M * np.sqrt(math.log(self.visits.sum()) / self.visits)
        return int(np.argmin(self.costs - bonus))

    def note(self, row: int, cost: float) -> None:
        """Running mean of what an action costs."""
        self.visits[row] += 1
        self.costs[row] += (cost - self.costs[row]) / self.visits[row]


@dataclass
class _State:
    """One simulated robot in one reading."""

    reading: int
    figure_seen: bool
    landmark_seen: bool
    place: int = _here
    looked: frozenset[int] = frozenset()
    """A second look from the same place shows nothing more."""


class Pomcp:
    """One decision's tree."""

    def __init__(self, problem: SearchProblem, rng: Generator) -> None:
        self._problem, self._rng = problem, rng
        self._nodes: dict[tuple[int, ...], _Node] = {}
        expected = 0.5 * problem.see_figure + 0.5 * np.maximum(
            problem.see_figure, problem.see_landmark
        )
        hidden = ~(problem.figure_seen & problem.landmark_seen)
        right = problem.declares[:, None] == problem.figure_id
        worth = np.where(problem.declares[:, None] >= 0, right, expected * hidden)
        self._worth: Floats = worth @ problem.probability
        """(C,) What each is worth on average: the order in which actions are tried."""

    def plan(self) -> Floats:
        """Costs (C,) of the candidates [m]; infinite for those that were never tried."""
        problem = self._problem
        readings = self._rng.choice(len(problem.probability), SIMULATIONS, p=problem.probability)
        for reading in readings.tolist():
            seen = bool(problem.figure_seen[reading]), bool(problem.landmark_seen[reading])
            self._simulate((), _State(reading, *seen))
        root = self._nodes[()]
        costs = np.full(len(problem.way), np.inf)
        tried = root.visits > 0
        costs[root.actions[tried]] = root.costs[tried]
        return costs

    def _simulate(self, history: tuple[int, ...], state: _State) -> float:
        """Cost of one simulation from a history on; every node on its way learns from it [m]."""
        if len(state.looked) >= DEPTH:
            return LOST_M
        node = self._nodes.get(history)
        if node is None:
            node = self._nodes[history] = _Node(self._actions(state))
            if history:
                return self._roll_out(state)
        if not len(node.actions):
            return LOST_M
        row = node.pick()
        action = int(node.actions[row])
        cost, after, observed = self._step(state, action)
        if after is not None:
            cost += self._simulate((*history, action, observed), after)
        node.note(row, cost)
        return cost

    def _actions(self, state: _State) -> Ints:
        """The most promising candidates from where the robot is, the best first."""
        rate = self._worth / (1.0 + self._problem.way_to(state.place))
        rate[list(state.looked)] = 0.0
        order = np.argsort(-rate, kind="stable")[:WIDTH]
        return order[rate[order] > 0].astype(np.int32)

    def _step(self, state: _State, action: int) -> tuple[float, _State | None, int]:
        """Way to drive, the state after it (None at the end), and what was observed."""
        problem, reading = self._problem, state.reading
        cost = 1.0 + float(problem.way_to(state.place)[action])
        if problem.declares[action] >= 0:
            right = problem.declares[action] == problem.figure_id[reading]
            return cost + (0.0 if right else WRONG_M), None, 0
        draws = self._rng.random(2)
        figure = state.figure_seen or bool(draws[0] < problem.see_figure[action, reading])
        landmark = state.landmark_seen or bool(draws[1] < problem.see_landmark[action, reading])
        known_before = state.figure_seen and state.landmark_seen
        if figure and landmark and not known_before:
            return cost + float(problem.to_figure[action, reading]), None, 3
        after = _State(reading, figure, landmark, action, state.looked | {action})
        return cost, after, 2 * figure + landmark

    def _roll_out(self, state: _State) -> float:
        """Cost of going on greedily, by worth a metre, without a tree [m]."""
        cost = 0.0
        after: _State | None = state
        while after is not None:
            if after.figure_seen and after.landmark_seen:
                return cost + float(self._problem.to_figure[after.place, after.reading])
            actions = self._actions(after)
            looks = actions[self._problem.declares[actions] < 0]
            if not len(looks) or len(after.looked) >= DEPTH:
                return cost + LOST_M
            step, after, _ = self._step(after, int(looks[0]))
            cost += step
        return cost
