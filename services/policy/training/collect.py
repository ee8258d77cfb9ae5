"""Runs episodes of the whole robot in which every decision is labelled by an expert.

The same nodes as ever, in lockstep; only the policy is one that also asks the expert, and with
probability beta does what he says.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from robots.catalogue import robot_of
from robots.spec import RobotSpec
from schemas.arrays import Floats
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from schemas.run import RunConfig
from services.policy.cost import Circumstances, Cost, Judgement, Words
from services.policy.linear import ExpertName, LinearWeights, cost_of, stops
from services.policy.policy import BeliefPolicy, Choice, Memory, Proposal
from services.policy.referents import Referents
from services.policy.rule import load_rule
from services.policy.training.experts import Advice, Expert, Setting, make_expert
from services.policy.training.truth import TrueWays
from services.policy.training.worlds import Practice
from sim.experiments.episode import Episode, Trial
from sim.experiments.montecarlo import REACHED_M
from sim.experiments.perception_model import PerceptionSettings
from sim.world import make_world

MOST_MOMENTS = 3
"""K of what is recorded, so that fewer can be tried on the same data."""
_patience = 0.7
"""Margin up to which an expert who acts goes on with what he follows, against dithering."""
_stream = 17
_most_decisions = 60
"""Of one episode that are kept, so that one that got stuck does not outweigh the others; and for
which the expert acts, who is stuck where he knows what the robot cannot see."""


@dataclass(frozen=True)
class Decision:
    """One labelled decision among C candidates."""

    features: NDArray[np.float32]
    """(C, K, D) with the most moments."""
    words: Words
    label: int
    margin: NDArray[np.float32]
    """(C,) see `Advice`."""


@dataclass(frozen=True)
class Rollout:
    """One episode to run."""

    practice: Practice
    robot: str
    weights: LinearWeights | None
    """Of the learner; None for one that has learned nothing, who should not act."""
    beta: float
    """Probability, at every decision, that the expert acts."""
    expert: ExpertName
    particles: int = 100


@dataclass(frozen=True)
class Episodic:
    """What became of it."""

    row: str
    seed: int
    decisions: tuple[Decision, ...]
    success: bool
    distance_m: float
    failure: str
    """Cause, "" for a success."""


Progress = Callable[[int, int], None]
"""Called with (done, of) after every episode."""


def workforce(count: int) -> AbstractContextManager[Executor | None]:
    """Processes that run episodes; none of its own where one is enough.

    They are kept for a whole training, as each takes seconds to begin.
    """
    if count == 1:
        return nullcontext(None)
    # Workers inherit the environment: several threads for matrices this small only cost time.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    return ProcessPoolExecutor(count, mp_context=get_context("spawn"))


def collect(
    rollouts: Sequence[Rollout], workers: Executor | None, progress: Progress
) -> list[Episodic]:
    """All episodes, in the order of the rollouts, whoever runs them."""
    found: dict[int, Episodic] = {}
    for number, episode in _finished(rollouts, workers):
        found[number] = episode
        progress(len(found), len(rollouts))
    return [found[number] for number in range(len(rollouts))]


def _finished(
    rollouts: Sequence[Rollout], workers: Executor | None
) -> Iterator[tuple[int, Episodic]]:
    if workers is None:
        yield from ((number, run_rollout(one)) for number, one in enumerate(rollouts))
        return
    numbers = {workers.submit(run_rollout, one): number for number, one in enumerate(rollouts)}
    for done in as_completed(numbers):
        yield numbers[done], done.result()


def run_rollout(rollout: Rollout) -> Episodic:
    """One episode; the same rollout gives the same one."""
    practice = rollout.practice
    scenario = practice.scenario
    run = RunConfig(
        robot=rollout.robot,
        world=scenario.world,
        seed=practice.seed,
        particles=rollout.particles,
        view_range_m=scenario.view_range_m,
        view_fov_rad=scenario.view_fov_rad,
    )
    labelled: list[LabelledPolicy] = []

    def policy(world_from_base: Callable[[], Pose2]) -> BeliefPolicy:
        labelled.append(_labelled(rollout, run, world_from_base))
        return labelled[0]

    trial = Trial(
        perception=PerceptionSettings(),
        intended=practice.goals,
        reached_m=REACHED_M,
        policy=policy,
    )
    result = Episode(run, scenario.text, trial=trial).run(lambda seconds, status: None)
    return Episodic(
        row=scenario.name,
        seed=practice.seed,
        decisions=tuple(labelled[0].decisions),
        success=result.success,
        distance_m=result.distance_m,
        failure=str(result.failure.value) if result.failure else "",
    )


def _labelled(
    rollout: Rollout, run: RunConfig, world_from_base: Callable[[], Pose2]
) -> "LabelledPolicy":
    spec, rule = robot_of(run), load_rule(rollout.robot)
    world = make_world(run.world, run.seed)
    truth = TrueWays(world, rollout.practice.goals, spec, world_from_base)
    cost = cost_of(rollout.weights) if rollout.weights else rule
    rng = np.random.default_rng([run.seed, _stream])
    expert = make_expert(rollout.expert, truth, rule)
    return LabelledPolicy(spec, cost, expert, rollout.beta, rng)


class WithAllMoments:
    """A cost that is offered more moments of the features than it reads."""

    moments = MOST_MOMENTS

    def __init__(self, cost: Cost) -> None:
        self._cost = cost
        self.gate = cost.gate

    def judge(self, features: Floats, circumstances: Circumstances) -> Judgement:
        """As the cost itself, of its own moments."""
        return self._cost.judge(features[:, : self._cost.moments], circumstances)


class LabelledPolicy(BeliefPolicy):
    """A policy that asks an expert at every decision, and writes down what he says.

    Args:
        spec: the robot.
        cost: the learner's.
        expert: who is asked.
        beta: probability that he acts.
        rng: decides who acts.
    """

    def __init__(
        self, spec: RobotSpec, cost: Cost, expert: Expert, beta: float, rng: Generator
    ) -> None:
        super().__init__(spec, WithAllMoments(cost))
        self._expert, self._beta, self._rng = expert, beta, rng
        self.decisions: list[Decision] = []

    def decide(
        self,
        belief: MapBelief,
        referents: Referents,
        grid: OccupancyGrid,
        map_from_base: Pose2,
        memory: Memory,
    ) -> Choice:
        """Note what the expert would do, and do that or one's own."""
        proposal = self.propose(belief, referents, grid, map_from_base, memory)
        choice = self.choose(proposal, referents, memory)
        if len(self.decisions) >= _most_decisions:
            return choice
        advice = self._expert.advise(Setting(proposal, belief, map_from_base, memory))
        self.decisions.append(_decision(proposal, advice, memory.words))
        if self._rng.random() >= self._beta:
            return choice
        searching = self.goal_of(referents, memory) is None
        patient = proposal.following and searching and bool(advice.margin[1] <= _patience)
        chosen = 1 if patient else advice.label
        return Choice(
            candidates=choice.candidates,
            costs=choice.costs,
            gains=choice.gains,
            chosen=chosen,
            confirmed=choice.confirmed,
            kept=proposal.following and chosen == 1,
            is_idle=False,
        )


def _decision(proposal: Proposal, advice: Advice, words: Words) -> Decision:
    """Without the stop that would declare nothing, which is no action."""
    features = proposal.features
    possible = np.flatnonzero(~stops(features) | (proposal.here > 0))
    return Decision(
        features=features[possible].astype(np.float32),
        words=words,
        label=int(np.flatnonzero(possible == advice.label)[0]),
        margin=advice.margin[possible].astype(np.float32),
    )


def rollouts_of(
    chosen: Sequence[Practice],
    robot: str,
    expert: ExpertName,
    weights: LinearWeights | None,
    beta: float,
) -> list[Rollout]:
    """One episode for every practice."""
    return [Rollout(practice, robot, weights, beta, expert) for practice in chosen]
