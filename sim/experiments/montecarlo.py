"""Many episodes: one for each arm and seed, every one counted."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.random import Generator

from schemas.run import RunConfig
from schemas.task import Failure
from sim.experiments.arms import Arm
from sim.experiments.episode import Episode, Trial
from sim.experiments.kept import Kept
from sim.experiments.montecarlo_job import Job, Result, Scenario
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.report import RESAMPLES, Interval, Row, Settings, rate_row
from sim.experiments.spread import finished

REACHED_M = 1.5
"""The paper's: a run succeeds if the robot stops this near the intended goal [m]."""

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
    kept = Kept(settings.keep) if settings.keep else None
    found = {number: kept.result_of(job) for number, job in enumerate(jobs)} if kept else {}
    results = {number: result for number, result in found.items() if result is not None}
    left = [number for number in range(len(jobs)) if number not in results]
    for done, (index, result) in enumerate(
        finished(run_job, [jobs[number] for number in left], settings.workers, settings.cluster),
        start=len(results) + 1,
    ):
        results[left[index]] = result
        if kept:
            kept.add(jobs[left[index]], result)
        progress(done, len(jobs), result)
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
