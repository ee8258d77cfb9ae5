"""What attention saves: the same episodes with it and without, through rendered cameras.

Both look through the same detector in the same worlds; times are of one process, one after the
other, so that the machine's mood meets both.
"""

from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace
from numpy.random import Generator

from schemas.run import RunConfig
from sim.experiments.episode import Episode, EpisodeResult
from sim.experiments.report import Outcome, Row, Settings, rate_row, time_row
from sim.node import require_pictures

TEXT = "go to the hydrant behind the cone"
WORLDS = ("hydrant", "two_hydrants")
EVERYTHING = "looks at everything"


@dataclass(frozen=True)
class Pair:
    """One world, with attention and without."""

    adaptive: EpisodeResult
    thorough: EpisodeResult


def measure(settings: Settings) -> Outcome:
    """`settings.runs` episodes of either kind in each world."""
    require_pictures("husky")
    rng = np.random.default_rng(settings.seed)
    rows: list[Row] = []
    failures: dict[str, dict[str, int]] = {"ours": {}, EVERYTHING: {}}
    for world in WORLDS:
        pairs = [_pair(world, settings.seed + k, settings) for k in range(settings.runs)]
        rows += rows_of(world, pairs, rng)
        for pair in pairs:
            for arm, one in (("ours", pair.adaptive), (EVERYTHING, pair.thorough)):
                if one.failure is not None:
                    failures[arm][one.failure] = failures[arm].get(one.failure, 0) + 1
    held = (f"{TEXT!r}, Husky, cameras rendered, perception times of a frame, median of episodes",)
    return Outcome(tuple(rows), failures, settings=held)


def rows_of(world: str, pairs: list[Pair], rng: Generator) -> list[Row]:
    """Perception time, its share of the time without attention, success, and the way driven."""
    ours, theirs = ([getattr(p, name) for p in pairs] for name in ("adaptive", "thorough"))
    spent = [[one.perception_ms_mean for one in arm] for arm in (ours, theirs)]
    share = [100 * a / max(b, 1e-9) for a, b in zip(*spent, strict=True)]
    ways = [[one.distance_m for one in arm] for arm in (ours, theirs)]
    successes = [[one.success for one in arm] for arm in (ours, theirs)]
    return [
        _beside(time_row(world, "perception, mean of a frame", spent[0], rng), np.median(spent[1])),
        replace(time_row(world, "perception, of the time without attention", share, rng), unit="%"),
        _beside(rate_row(world, "success", successes[0]), 100 * np.mean(successes[1])),
        replace(_beside(time_row(world, "way driven", ways[0], rng), np.median(ways[1])), unit="m"),
    ]


def _beside(row: Row, everything: float | np.floating) -> Row:
    return replace(row, arms={EVERYTHING: float(everything)})


def _pair(world: str, seed: int, settings: Settings) -> Pair:
    settings.progress(f"{world}, world {seed}")
    return Pair(*(_episode(world, seed, adaptive) for adaptive in (True, False)))


def _episode(world: str, seed: int, adaptive: bool) -> EpisodeResult:
    run = RunConfig(world=world, seed=seed, adaptive=adaptive)
    return Episode(run, TEXT).run(lambda _seconds, _status: None)
