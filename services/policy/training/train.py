"""Trains a robot's policy and keeps the weights of the best round with a report beside them."""

from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from robots.catalogue import get_robot
from services.policy.belief_features import names
from services.policy.linear import WeightsError, save_linear, weights_path
from services.policy.training.collect import MOST_MOMENTS
from services.policy.training.dagger import Progress, TrainSettings, train
from services.policy.training.worlds import TRAINING_SEEDS, VALIDATION_SEEDS


def train_policy(
    settings: TrainSettings, progress: Progress, folder: Path | None = None
) -> dict[str, Any]:
    """Collect, label and fit in rounds; write the weights.

    Args:
        settings: what to learn.
        progress: told what is being done.
        folder: where weights and report are written; the package's own by default.

    Returns:
        The report, also written beside the weights as `<robot>.<expert>.report.json`. Weights
        with another number of moments K, from the same data, are `<robot>.<expert>.k<K>.json`.

    Raises:
        UnknownRobotError: there is no such robot.
        WeightsError: a setting is out of its range.
    """
    get_robot(settings.robot)
    _check(settings)
    own = weights_path(settings.robot, settings.expert)
    path = own if folder is None else folder / own.name
    trained = train(settings, progress, partial(save_linear, path))
    for moments, weights in trained.other_moments.items():
        save_linear(path.with_suffix(f".k{moments}.json"), weights)
    report: dict[str, Any] = {
        "robot": settings.robot,
        "expert": settings.expert,
        "moments": settings.moments,
        "features": list(names),
        "git": trained.weights.provenance.git,
        "seed": settings.seed,
        "training_seeds": _seeds(TRAINING_SEEDS, settings, settings.rounds * settings.episodes),
        "validation_seeds": _seeds(VALIDATION_SEEDS, settings, settings.validation),
        "best_round": trained.best,
        "rounds": msgspec.to_builtins(trained.rounds),
        "by_moments": msgspec.to_builtins(trained.by_moments),
        "train_s": round(trained.elapsed_s, 1),
    }
    text = msgspec.json.format(msgspec.json.encode(report), indent=1)
    path.with_suffix(".report.json").write_bytes(text + b"\n")
    progress("done", 1.0)
    return report


def _check(settings: TrainSettings) -> None:
    numbers = (settings.rounds, settings.episodes, settings.validation, settings.workers)
    if min(numbers) < 1:
        raise WeightsError(
            "rounds, episodes, validation and workers are at least 1, given: "
            + ", ".join(map(str, numbers))
        )
    if not 1 <= settings.moments <= MOST_MOMENTS:
        raise WeightsError(f"moments are 1 to {MOST_MOMENTS}, given: {settings.moments}")


def _seeds(first: int, settings: TrainSettings, count: int) -> list[int]:
    """First and last."""
    return [first + settings.seed, first + settings.seed + count - 1]
