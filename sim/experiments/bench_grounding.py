"""Grounding against sentences no training has seen: how right, how calibrated and how fast."""

import time
from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from services.grounding.corpus import CORPORA
from services.grounding.model import GroundingModel
from services.grounding.training.calibration import expected_calibration_error
from sim.experiments.bench_grounding_scaling import (
    behavior_times_ms,
    paper_ms,
    trained_robots,
)
from sim.experiments.bench_hierarchy import hierarchy_rows
from sim.experiments.bench_sentences import Listener, Sentence, Verdict, judge, read_sentences
from sim.experiments.report import (
    RESAMPLES,
    Failures,
    Interval,
    Outcome,
    Row,
    Settings,
    rate_row,
    time_row,
)

SENTENCES = {"median sentence": 0.5, "slowest of 20 sentences": 0.95}
"""Quantiles over the sentences that annotation inference is timed for."""
OBJECTS = (24, 200)
"""Sizes of the maps that behaviour inference is timed in; the paper's trials end at 24."""


def measure(settings: Settings) -> Outcome:
    """Rows of every robot that has words, and failures by robot and cause."""
    rng = np.random.default_rng(settings.seed)
    rows: list[Row] = []
    failures: Failures = {}
    for robot in trained_robots():
        settings.progress(f"{robot}: held-out sentences")
        listener = Listener.of(robot)
        sentences = unseen_sentences(robot)
        settings.progress(f"{len(sentences)} of {len(read_sentences(robot))} are in no corpus")
        verdicts = [judge(one, listener.hear(one)) for one in sentences]
        rows += quality_rows(robot, verdicts, rng)
        failures[robot] = causes(verdicts)
        rows += hierarchy_rows(robot, listener.model, [one.text for one in sentences], rng)
        settings.progress(f"{robot}: times")
        rows += _speed_rows(robot, sentences, settings.runs, rng)
    return Outcome(tuple(rows), failures)


def unseen_sentences(robot: str) -> tuple[Sentence, ...]:
    """Held-out sentences less those that stand in the corpus all the same, by chance."""
    corpus = (CORPORA / f"{robot}.txt").read_text(encoding="utf-8").lower()
    seen = {line.strip() for line in corpus.splitlines()}
    return tuple(
        one for one in read_sentences(robot) if len(one.turns) > 1 or one.text.lower() not in seen
    )


def quality_rows(robot: str, verdicts: Sequence[Verdict], rng: Generator) -> list[Row]:
    """Rates and calibration; sentences to be refused have a row of their own."""
    known = [one for one in verdicts if not one.sentence.refused]
    strange = [one for one in verdicts if one.sentence.refused]
    annotation = [one.annotation for one in known]
    behavior = [one.behavior for one in known]
    return [
        rate_row(robot, "complete parse", [one.parsed for one in known]),
        rate_row(robot, "annotation exactly right", annotation),
        rate_row(robot, "behavior exactly right", behavior),
        rate_row(robot, "unknown words refused and named", [one.behavior for one in strange]),
        _calibration_row(
            robot, "annotation", [one.annotation_confidence for one in known], annotation, rng
        ),
        _calibration_row(
            robot, "behavior", [one.behavior_confidence for one in known], behavior, rng
        ),
    ]


def _calibration_row(
    robot: str, what: str, stated: Sequence[float], right: Sequence[bool], rng: Generator
) -> Row:
    confidence, correct = np.array(stated), np.array(right, dtype=np.bool_)
    return Row(
        row=robot,
        metric=f"expected calibration error of the best {what}",
        unit="",
        better="lower",
        ours=expected_calibration_error(confidence, correct),
        interval=_calibration_interval(confidence, correct, rng),
    )


def _calibration_interval(
    confidence: NDArray[np.float64], correct: NDArray[np.bool_], rng: Generator
) -> Interval:
    drawn = rng.integers(0, len(confidence), (RESAMPLES, len(confidence)))
    errors = [expected_calibration_error(confidence[rows], correct[rows]) for rows in drawn]
    low, high = np.quantile(errors, [0.025, 0.975])
    return float(low), float(high)


def causes(verdicts: Sequence[Verdict]) -> dict[str, int]:
    """How often each variety of phrase failed for each cause; never the sentences."""
    return dict(Counter(f"{v.sentence.variety}: {cause}" for v in verdicts for cause in v.causes))


def _speed_rows(robot: str, sentences: Sequence[Sentence], runs: int, rng: Generator) -> list[Row]:
    times = _annotation_times_ms(robot, sentences, runs)
    rows: list[Row] = []
    for name, quantile in SENTENCES.items():
        per_run: list[float] = np.quantile(times, quantile, axis=1).tolist()
        rows.append(time_row(robot, f"annotation inference, {name}", per_run, rng))
    for count in OBJECTS:
        sampled = behavior_times_ms(robot, count, runs, rng)
        metric = f"behavior inference per particle, {count} objects"
        rows.append(time_row(robot, metric, sampled, rng, paper_ms(robot, count)))
    return rows


def _annotation_times_ms(
    robot: str, sentences: Sequence[Sentence], runs: int
) -> NDArray[np.float64]:
    """Time of every sentence in each run [ms] (runs, sentences).

    Every run has a model of its own, so that nothing is remembered from the run before.
    """
    times = np.empty((runs, len(sentences)))
    for run in range(runs):
        model = GroundingModel.load(robot)
        for at, sentence in enumerate(sentences):
            started = time.perf_counter()
            model.understand(sentence.text)
            times[run, at] = 1000 * (time.perf_counter() - started)
    return times
