"""Many episodes: one for each arm and seed, every one counted."""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from msgspec import Struct
from numpy.random import Generator

from schemas.run import RunConfig
from schemas.task import Failure
from sim.experiments.arms import Arm
from sim.experiments.episode import Episode, Trial
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.report import RESAMPLES, Interval, Row, Settings, rate_row
from sim.experiments.spread import finished
from sim.scenes.object_relative import GOAL

REACHED_M = 1.5
"""The paper's: a run succeeds if the robot stops this near the intended goal [m]."""


PARTICLES = 100


class Scenario(Struct, frozen=True, kw_only=True):
    """One row of a table: what is asked for in which kind of world, and how far the robot sees."""

    name: str
    world: str
    text: str
    view_range_m: float
    """0 is the robot's own camera."""
    view_fov_rad: float = 2 * math.pi
    """The paper names a range alone: it sees all round."""
    robot: str = "husky"
    goal: str = GOAL
    """Id of what is meant."""
    answers: bool = False
    """Whether a simulated person answers the robot's first question."""


@dataclass(frozen=True)
class Job:
    """One episode to be run."""

    scenario: Scenario
    arm: Arm
    seed: int
    perception: PerceptionSettings
    particles: int = PARTICLES


class Result(Struct, frozen=True, kw_only=True):
    """What became of it."""

    scenario: str
    arm: Arm
    seed: int
    success: bool
    at_class: bool
    """Whether the robot declared the goal reached beside any object of the goal's class."""
    failure: Failure | None
    distance_m: float
    shortest_m: float
    time_s: float
    decisions: int
    log_sha256: str
    questions: int = 0
    """How many the robot asked."""

    @property
    def path_efficiency(self) -> float:
        """Success weighted by path length (Anderson et al., 2018)."""
        longest = max(self.distance_m, self.shortest_m, 1e-9)
        return self.shortest_m / longest if self.success else 0.0


Progress = Callable[[int, int, Result], None]
"""Called with (done, of, result) after every episode."""


def run_job(job: Job) -> Result:
    """One episode; the same job gives the same result."""
    scenario = job.scenario
    run = RunConfig(
        robot=scenario.robot,
        world=scenario.world,
        seed=job.seed,
        particles=job.particles,
        view_range_m=scenario.view_range_m,
        view_fov_rad=scenario.view_fov_rad,
    )
    trial = Trial(
        arm=job.arm,
        perception=job.perception,
        intended=(scenario.goal,),
        reached_m=REACHED_M,
        answers=scenario.answers,
    )
    episode = Episode(run, scenario.text, trial=trial)
    found = episode.run(lambda seconds, status: None)
    goal_class = scenario.goal.rpartition("_")[0]
    at_goal_class = any(name.startswith(goal_class) for name in episode.within_reach)
    declared = found.failure in (None, Failure.WRONG_OBJECT)
    return Result(
        scenario=scenario.name,
        arm=job.arm,
        seed=job.seed,
        success=found.success,
        at_class=declared and at_goal_class,
        failure=found.failure,
        distance_m=found.distance_m,
        shortest_m=found.shortest_path_m,
        time_s=found.time_s,
        decisions=found.decisions,
        log_sha256=found.log_sha256,
        questions=episode.questions,
    )


def run_jobs(jobs: Sequence[Job], settings: Settings, progress: Progress) -> list[Result]:
    """All results, in the order of the jobs."""
    results: dict[int, Result] = {}
    for number, result in finished(run_job, jobs, settings.workers, settings.cluster):
        results[number] = result
        progress(len(results), len(jobs), result)
    return [results[number] for number in range(len(jobs))]


def jobs_of(
    scenario: Scenario, runs: Mapping[Arm, int], seed: int, settings: PerceptionSettings
) -> list[Job]:
    """Seeds `seed`, `seed + 1`, ...: all arms meet the same worlds, some of them fewer."""
    return [
        Job(scenario, arm, seed + index, settings)
        for arm, count in runs.items()
        for index in range(count)
    ]


def mean_interval(samples: Sequence[float], rng: Generator) -> Interval:
    """95 % percentile interval of the mean, by resampling with replacement (Efron, 1979)."""
    values = np.asarray(samples, dtype=np.float64)
    means = values[rng.integers(0, len(values), (RESAMPLES, len(values)))].mean(axis=1)
    low, high = np.quantile(means, [0.025, 0.975])
    return float(low), float(high)


def success_row(
    scenario: str,
    results: Sequence[Result],
    paper: float | None = None,
    any_of_class: bool = False,
) -> Row:
    """Share of successes of our arm [%], the other arms' beside it."""
    shares = {
        arm: [one.at_class if any_of_class else one.success for one in of_arm]
        for arm, of_arm in by_arm(results).items()
    }
    metric = "success, any of the class" if any_of_class else "success"
    row = rate_row(scenario, metric, shares.pop("ours"))
    arms = {arm: 100 * float(np.mean(share)) for arm, share in shares.items()}
    return with_arms(row, paper, arms)


def mean_row(
    scenario: str,
    metric: str,
    unit: str,
    results: Sequence[Result],
    value: Callable[[Result], float],
    rng: Generator,
    paper: float | None = None,
) -> Row:
    """Mean of a figure over all runs, failures included."""
    values = {arm: [value(one) for one in of_arm] for arm, of_arm in by_arm(results).items()}
    ours = values.pop("ours")
    return Row(
        row=scenario,
        metric=metric,
        unit=unit,
        better="lower" if unit == "m" else "higher",
        paper=paper,
        ours=float(np.mean(ours)),
        interval=mean_interval(ours, rng),
        arms={arm: float(np.mean(of_arm)) for arm, of_arm in values.items()},
    )


def with_arms(row: Row, paper: float | None, arms: dict[str, float]) -> Row:
    """The row with the paper's and the other arms' figures."""
    return Row(
        row=row.row, metric=row.metric, unit=row.unit, better=row.better, paper=paper,
        ours=row.ours, interval=row.interval, arms=arms,
    )  # fmt: skip


def by_arm(results: Sequence[Result]) -> dict[str, list[Result]]:
    """Results grouped, ours first."""
    groups: dict[str, list[Result]] = {"ours": []}
    for result in results:
        groups.setdefault(result.arm, []).append(result)
    return groups


def failures_of(results: Sequence[Result]) -> dict[str, dict[str, int]]:
    """Failures by arm and cause; arms without any are left out."""
    counts = {
        arm: Counter(str(one.failure.value) for one in of_arm if one.failure)
        for arm, of_arm in by_arm(results).items()
    }
    return {arm: dict(causes) for arm, causes in counts.items() if causes}


def progress_lines(say: Callable[[str], None]) -> Progress:
    """Tells every twentieth part of the way, and every failure of our arm."""

    def tell(done: int, total: int, result: Result) -> None:
        if result.arm == "ours" and not result.success:
            say(f"{result.scenario}, seed {result.seed}: {result.failure}")
        if done * 20 // total != (done - 1) * 20 // total:
            filled = done * 20 // total
            say(f"[{'#' * filled}{'.' * (20 - filled)}] {done} of {total} episodes")

    return tell
