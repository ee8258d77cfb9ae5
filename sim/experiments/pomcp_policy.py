"""The policy with POMCP in place of a cost that is linear or set by hand."""

from dataclasses import replace

import numpy as np
from numpy.random import Generator

from robots.catalogue import robot_of
from schemas.arrays import Floats
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from schemas.run import RunConfig
from services.policy.belief_features import features, names
from services.policy.candidates import Candidates, Kind
from services.policy.node import own_policy
from services.policy.policy import BeliefPolicy, Choice, Memory
from services.policy.referents import Referents
from services.runtime.node import node_generator
from sim.experiments.pomcp import Pomcp, SearchProblem

_hopeless_m = 1e4
_found_in_new_ground = 0.5
"""Probability that a full view of ground nobody has looked at shows what no hypothesis knows of."""
_near_m = 2.0
"""From there to it [m]."""
_keep = 0.8
"""Cost factor of the goal that is being followed, against dithering."""
_nothing = -2


class PomcpPolicy(BeliefPolicy):
    """Proposes as the policy does, and decides by simulating what would be seen.

    Args:
        run: names the robot.
        rng: of all simulations.
    """

    def __init__(self, run: RunConfig, rng: Generator) -> None:
        super().__init__(robot_of(run), own_policy(run).cost)
        self._rng = rng

    @staticmethod
    def of(run: RunConfig) -> "PomcpPolicy":
        """With randomness of its own."""
        return PomcpPolicy(run, node_generator(run, "policy"))

    def decide(
        self,
        belief: MapBelief,
        referents: Referents,
        grid: OccupancyGrid,
        map_from_base: Pose2,
        memory: Memory,
    ) -> Choice:
        """The candidate after which the goal is reached soonest on average."""
        proposal = self.propose(belief, referents, grid, map_from_base, memory)
        choice = self.choose(proposal, referents, memory)
        candidates = proposal.candidates
        here = np.zeros(len(candidates))
        here[0] = proposal.here
        situation = self._situation(grid, map_from_base, memory)
        phi = features(situation, candidates, here, referents)
        costs = Pomcp(problem_of(candidates, phi, referents, here), self._rng).plan()
        if not np.isfinite(costs).any():
            return choice
        costs = np.minimum(costs, _hopeless_m)
        costs[1 : 1 + proposal.following] *= _keep
        chosen = int(np.argmin(costs))
        kept = proposal.following and chosen == 1
        return replace(choice, costs=costs, chosen=chosen, kept=kept, is_idle=False)


def problem_of(
    candidates: Candidates, phi: Floats, referents: Referents, here: Floats
) -> SearchProblem:
    """The search as arrays.

    Args:
        candidates: C of them.
        phi: their features (C, M, D).
        referents: M readings.
        here: (C,) 1 where the robot stands at the candidate's thing.
    """
    see_figure = phi[..., names.index("see_figure")].copy()
    see_either = phi[..., names.index("see_either")]
    see_landmark = 1 - (1 - see_either) / np.maximum(1 - see_figure, 1e-9)
    unknown = ~referents.known
    area = np.clip(phi[:, 0, names.index("new_area")], 0.0, 1.0)
    see_figure[:, unknown] = _found_in_new_ground * area[:, None]
    pose = candidates.pose[:, :2]
    to_figure = np.linalg.norm(pose[:, None] - referents.figure, axis=2)
    to_figure[:, unknown] = _near_m
    is_stop = np.array([kind is Kind.STOP for kind in candidates.kinds])
    declares = np.where(is_stop & (here == 0), -1, candidates.object_id)
    return SearchProblem(
        probability=referents.probability,
        way=phi[:, 0, names.index("length")],
        between=np.linalg.norm(pose[:, None] - pose, axis=2),
        see_figure=np.clip(see_figure, 0.0, 1.0),
        see_landmark=np.clip(see_landmark, 0.0, 1.0),
        figure_seen=referents.figure_seen,
        landmark_seen=referents.landmark_seen | unknown,
        to_figure=to_figure,
        declares=declares.astype(np.int32),
        figure_id=np.where(referents.figure_seen, referents.figure_id, np.int32(_nothing)),
    )
