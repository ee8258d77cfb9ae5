"""DAgger: act, be corrected, learn from all corrections so far, act again (Ross et al., 2011)."""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from msgspec import Struct

from services.policy.linear import ExpertName, LinearWeights, Provenance, default_expert
from services.policy.training.collect import (
    MOST_MOMENTS,
    Decision,
    Episodic,
    collect,
    rollouts_of,
    workforce,
)
from services.policy.training.weigh import Learned, learn
from services.policy.training.worlds import TRAINING_SEEDS, VALIDATION_SEEDS, practices
from services.runtime.provenance import git_revision

_betas = (1.0, 0.3, 0.3)
"""How often the expert acts, by round; afterwards never."""
Progress = Callable[[str, float], None]
"""Called with what is being done and the share of it that is done, in [0, 1]."""


@dataclass(frozen=True)
class TrainSettings:
    """What to learn, from whom, and how long."""

    robot: str = "husky"
    expert: ExpertName = default_expert
    rounds: int = 4
    episodes: int = 10
    """In every round, of each row of `worlds.practices`."""
    validation: int = 8
    """Episodes of each row after every round, in worlds that are not trained on."""
    workers: int = 2
    moments: int = 2
    """K"""
    seed: int = 0


class Score(Struct, frozen=True, kw_only=True):
    """How a policy does on the validation worlds."""

    agreement: float
    """Share of its decisions that are the expert's."""
    loss: float
    """Mean hinge loss of them."""
    success: float
    distance_m: float
    """Mean over all episodes."""
    success_by_row: dict[str, float]
    distance_by_row: dict[str, float]

    @property
    def summary(self) -> str:
        """One line for people."""
        return (
            f"as the expert {self.agreement:.0%}, success {self.success:.0%}, "
            f"distance {self.distance_m:.1f} m"
        )


class Round(Struct, frozen=True, kw_only=True):
    """One round of acting and learning."""

    number: int
    beta: float
    decisions: int
    """So far."""
    training_agreement: float
    training_loss: float
    validation: Score


class Compared(Struct, frozen=True, kw_only=True):
    """The same data fitted with another number of moments."""

    moments: int
    validation: Score


@dataclass(frozen=True)
class Trained:
    """The best round, and how all of them went."""

    weights: LinearWeights
    best: int
    rounds: tuple[Round, ...]
    by_moments: tuple[Compared, ...]
    other_moments: dict[int, LinearWeights]
    """The same data fitted with another K, by K."""
    elapsed_s: float


Keep = Callable[[LinearWeights], None]
"""Told of the best weights so far, so that they outlive a training that is ended early."""


def train(settings: TrainSettings, progress: Progress, keep: Keep) -> Trained:
    """All rounds; returns the weights of the best one on the validation worlds, not the last.

    The best has the least loss in the states that it gets itself into. Distances depend on where
    things happened to be, so that few episodes say little; and the weights of a round in which
    only the expert acted never met what a learner gets itself into, so they are not taken.
    """
    with workforce(settings.workers) as workers:
        return _Training(settings, workers, progress, keep).run()


class _Training:
    def __init__(
        self, settings: TrainSettings, workers: Executor | None, progress: Progress, keep: Keep
    ) -> None:
        self._settings, self._workers = settings, workers
        self._progress, self._keep = progress, keep
        self._git = git_revision()  # Before weights are kept, which changes the tree.
        self._decisions: list[Decision] = []
        self._rounds: list[Round] = []
        self._weights: list[LinearWeights] = []
        self._others: dict[int, LinearWeights] = {}

    def run(self) -> Trained:
        started = time.perf_counter()
        for number in range(self._settings.rounds):
            self._round(number)
            if self._best == number:
                self._keep(self._weights[number])
        best = self._best
        compared = self._compared(best)
        return Trained(
            weights=self._weights[best],
            best=best,
            rounds=tuple(self._rounds),
            by_moments=tuple(compared),
            other_moments=self._others,
            elapsed_s=time.perf_counter() - started,
        )

    @property
    def _best(self) -> int:
        met = [one for one in self._rounds if one.beta < 1] or self._rounds
        return min(met, key=lambda one: one.validation.loss).number

    def _round(self, number: int) -> None:
        beta = _betas[number] if number < len(_betas) else 0.0
        self._act(number, beta)
        learned = self._learn(f"round {number}", self._decisions, self._settings.moments)
        score = self._validate(f"round {number}", learned, number, len(self._decisions))
        agreement, loss = learned.score(self._decisions)
        self._weights.append(self._struct(learned, number, len(self._decisions), score))
        self._progress(f"round {number}: {score.summary}", 1.0)
        self._rounds.append(
            Round(
                number=number,
                beta=beta,
                decisions=len(self._decisions),
                training_agreement=round(agreement, 4),
                training_loss=round(loss, 4),
                validation=score,
            )
        )

    def _act(self, number: int, beta: float) -> None:
        settings = self._settings
        first = TRAINING_SEEDS + settings.seed
        chosen = practices(first, settings.episodes, number * settings.episodes)
        weights = self._weights[-1] if self._weights else None
        rollouts = rollouts_of(chosen, settings.robot, settings.expert, weights, beta)
        episodes = collect(rollouts, self._workers, self._sharing(f"round {number}: acting"))
        self._decisions += [one for episode in episodes for one in episode.decisions]

    def _learn(self, what: str, decisions: Sequence[Decision], moments: int) -> Learned:
        say = self._progress
        return learn(
            decisions,
            moments,
            self._settings.seed,
            progress=lambda words: say(f"{what}: learning, {words} words", 0.0),
        )

    def _validate(self, what: str, learned: Learned, number: int, decisions: int) -> Score:
        settings = self._settings
        chosen = practices(VALIDATION_SEEDS + settings.seed, settings.validation)
        weights = self._struct(learned, number, decisions, None)
        rollouts = rollouts_of(chosen, settings.robot, settings.expert, weights, 0.0)
        tell = self._sharing(f"{what}: validating")
        return score_of(learned, collect(rollouts, self._workers, tell))

    def _compared(self, best: int) -> list[Compared]:
        """The data of the best round with other numbers of moments."""
        count, own = self._rounds[best].decisions, self._settings.moments
        compared: list[Compared] = []
        for moments in range(1, MOST_MOMENTS + 1):
            score = self._rounds[best].validation
            if moments != own:
                what = f"K = {moments}"
                learned = self._learn(what, self._decisions[:count], moments)
                score = self._validate(what, learned, best, count)
                self._others[moments] = self._struct(learned, best, count, score)
            compared.append(Compared(moments=moments, validation=score))
        return compared

    def _struct(
        self, learned: Learned, number: int, decisions: int, score: Score | None
    ) -> LinearWeights:
        return learned.struct(
            Provenance(
                git=self._git,
                seed=self._settings.seed,
                expert=self._settings.expert,
                rounds=number + 1,
                decisions=decisions,
                agreement=score.agreement if score else 0.0,
                success=score.success if score else 0.0,
            )
        )

    def _sharing(self, what: str) -> Callable[[int, int], None]:
        return lambda done, total: self._progress(what, done / total)


def score_of(learned: Learned, episodes: Sequence[Episodic]) -> Score:
    """How the policy did in the episodes, and how often the expert would have done the same."""
    agreement, loss = learned.score([one for episode in episodes for one in episode.decisions])
    rows = list(dict.fromkeys(episode.row for episode in episodes))
    by_row = {row: [one for one in episodes if one.row == row] for row in rows}
    return Score(
        agreement=round(agreement, 4),
        loss=round(loss, 4),
        success=round(float(np.mean([one.success for one in episodes])), 4),
        distance_m=round(float(np.mean([one.distance_m for one in episodes])), 3),
        success_by_row={
            row: round(float(np.mean([one.success for one in of_row])), 4)
            for row, of_row in by_row.items()
        },
        distance_by_row={
            row: round(float(np.mean([one.distance_m for one in of_row])), 3)
            for row, of_row in by_row.items()
        },
    )
