"""Parts of our own method taken out, one at a time."""

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from robots.catalogue import robot_of
from schemas.belief import MapBelief, OccupancyGrid
from schemas.errors import UserError
from schemas.geometry import Pose2
from schemas.run import RunConfig
from services.mapping.filter import SemanticFilter
from services.mapping.grid import Grid
from services.mapping.target import Evidence
from services.policy.linear import default_expert, load_linear, weights_path
from services.policy.node import own_policy
from services.policy.policy import BeliefPolicy, Choice, Memory
from services.policy.referents import Referents

_never_looked = Grid((0.0, 0.0))
"""Nobody writes into it."""


def weights_with(robot: str, moments: int) -> Path:
    """Where the learned cost with another K is kept, beside the robot's own."""
    return weights_path(robot, default_expert).with_suffix(f".k{moments}.json")


def policy_with(run: RunConfig, moments: int) -> BeliefPolicy:
    """The learned policy that reads K moments of the features.

    Raises:
        UserError: nobody has trained one.
    """
    path = weights_with(run.robot, moments)
    if not path.exists():
        raise UserError(
            f"no weights {path.name} in {path.parent}; 'incognita train policy --robot {run.robot} "
            f"--moments {moments}' makes them, to be kept under that name"
        )
    return BeliefPolicy(robot_of(run), load_linear(path))


class UnconfirmedPolicy(BeliefPolicy):
    """Takes imagined landmarks for seen ones: what stands where they are is the goal."""

    @staticmethod
    def of(run: RunConfig) -> "UnconfirmedPolicy":
        """With the robot's own cost."""
        return UnconfirmedPolicy(robot_of(run), own_policy(run).cost)

    def decide(
        self,
        belief: MapBelief,
        referents: Referents,
        grid: OccupancyGrid,
        map_from_base: Pose2,
        memory: Memory,
    ) -> Choice:
        """As if every landmark had been seen."""
        return super().decide(belief, _confirmed(referents), grid, map_from_base, memory)

    def goal_of(self, referents: Referents, memory: Memory) -> int | None:
        """As if every landmark had been seen."""
        return super().goal_of(_confirmed(referents), memory)


def _confirmed(referents: Referents) -> Referents:
    return replace(referents, landmark_seen=np.ones_like(referents.landmark_seen))


class FilterWithoutAbsence(SemanticFilter):
    """Hypotheses do not lose weight where the robot has looked and nothing was."""

    @property
    def evidence(self) -> Evidence:
        """With a grid that nobody has looked at."""
        return replace(super().evidence, grid=_never_looked)


@dataclass(frozen=True)
class _FiguresAlone(Evidence):
    @property
    def for_landmarks(self) -> Evidence:
        """With a grid that nobody has looked at."""
        return replace(self, grid=_never_looked)


class FilterWithoutAbsentLandmarks(SemanticFilter):
    """The same for landmarks alone: the paper weighs where the goal is not, no more."""

    @property
    def evidence(self) -> Evidence:
        """All of it for figures, and for landmarks what was seen."""
        whole = super().evidence
        return _FiguresAlone(**{field.name: getattr(whole, field.name) for field in fields(whole)})
