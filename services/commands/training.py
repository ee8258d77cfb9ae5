"""Verbs that learn from the data in the tree."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from schemas.errors import MissingComponentError, UserError
from services.commands.output import print_json, print_table


def train(
    what: Annotated[
        Literal["grounding", "policy", "detector", "forms", "places"], tyro.conf.Positional
    ],
    robot: str = "husky",
    data: Path | None = None,
    epochs: int | None = None,
    minutes: float | None = None,
    check: Path | None = None,
    annotate: Path | None = None,
    like: str | None = None,
    rounds: int = 4,
    episodes: int = 10,
    validation: int = 8,
    workers: int = 2,
    moments: int = 2,
    expert: Literal["least_way", "detection_rate", "clairvoyant"] = "least_way",
    seed: int = 0,
    json: bool = False,
) -> int:
    """Train from our own data; writes the weights and a report with held-out figures.

    Args:
        what: grounding: words of one robot, seconds; policy: where to go, by practice in simulated
            worlds, half an hour; detector: the camera's network, five hours of one processor;
            forms: how large things are behind what is seen of them, minutes; places: the network
            that tells kinds of places apart, half an hour.
        robot: whose words (grounding), or whose policy.
        data: folder for rendered pictures (detector, places); made if it is not there, resumed if
            it is. By default runs/detector-data or runs/places-data.
        epochs: passes over the pictures in all (detector, 50 by default; places, 16).
        minutes: ends this call early (detector, places); called again, it goes on from where it
            was.
        check: corpus file to check instead of training (grounding).
        annotate: file of sentences, one a line, to print in corpus format for correction instead
            of training (grounding); - reads them from stdin.
        like: robot whose weights propose annotations where this one has none yet (grounding).
        rounds: of acting and learning (policy).
        episodes: in every round, of each kind of world and sentence (policy).
        validation: likewise after every round, in worlds that are not trained on (policy).
        workers: processes that act (policy) or render (detector) at once, threads that train it.
        moments: K, of the features over the hypotheses, 1 to 3; the report compares them (policy).
        expert: who is imitated (policy): least_way and detection_rate know what the robot knows
            and plan a search or look where it is likeliest to see something soon; clairvoyant, the
            paper's, knows the map.
        seed: decides worlds and every random choice (policy).
        json: one JSON document on stdout.
    """
    if check is not None or annotate is not None or like is not None:
        from services.commands import corpus

        if what != "grounding":
            raise UserError(f"--check, --annotate and --like are for grounding, not {what}")
        return corpus.run(robot, check, annotate, like, json)
    if what == "policy":
        report = _policy(robot, rounds, episodes, validation, workers, moments, expert, seed)
    elif what == "forms":
        from services.commands import forms

        report = forms.learn()
    elif what == "places":
        from services.commands import places

        report = places.learn(data or Path("runs/places-data"), epochs or 16, minutes)
    else:
        folder, passes = data or Path("runs/detector-data"), epochs or 50
        report = (
            _grounding(robot)
            if what == "grounding"
            else _detector(folder, passes, minutes, workers)
        )
    if json:
        print_json(report)
    else:
        _print(report)
    return 0


def _print(report: dict[str, Any]) -> None:
    if "by_moments" in report:
        _print_rounds(report)
        return
    names = [name for name in ("reliability", "confusion", "placings") if name in report]
    tables = {name: report.pop(name) for name in names}
    for name, value in report.items():
        print(f"{name}: {value}")
    for name, rows in tables.items():
        print(f"{name}, held out:{'' if rows else ' none'}")
        if rows:
            print_table(tuple(rows[0]), [tuple(row.values()) for row in rows])


def _print_rounds(report: dict[str, Any]) -> None:
    """The report of a policy: every round, then every number of moments."""
    head = ("agreement", "loss", "success", "distance_m")
    rounds = [
        (one["number"], one["beta"], one["decisions"], *(one["validation"][name] for name in head))
        for one in report.pop("rounds")
    ]
    moments = [
        (one["moments"], *(one["validation"][name] for name in head))
        for one in report.pop("by_moments")
    ]
    for name, value in report.items():
        print(f"{name}: {value}")
    print("on validation worlds, after each round:")
    print_table(("round", "beta", "decisions", *head), rounds)
    print("the best round's data with K moments:")
    print_table(("K", *head), moments)


def _bar() -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
    )


def _grounding(robot: str) -> dict[str, Any]:
    from services.commands import corpus
    from services.grounding.training.train import train_grounding

    with _bar() as bar:
        task = bar.add_task("training", total=1.0)

        def progress(doing: str, share: float) -> None:
            bar.update(task, description=doing, completed=share)

        report = train_grounding(robot, progress)
    return report | corpus.evaluation(robot)


def _policy(
    robot: str,
    rounds: int,
    episodes: int,
    validation: int,
    workers: int,
    moments: int,
    expert: Literal["least_way", "detection_rate", "clairvoyant"],
    seed: int,
) -> dict[str, Any]:
    from services.policy.training.dagger import TrainSettings
    from services.policy.training.train import train_policy
    from sim import vulkan

    vulkan.activate()
    settings = TrainSettings(robot, expert, rounds, episodes, validation, workers, moments, seed)
    with _bar() as bar:
        task = bar.add_task("training", total=1.0)

        def progress(doing: str, share: float) -> None:
            bar.update(task, description=doing, completed=share)
            if share == 1.0:
                bar.console.print(doing)

        return train_policy(settings, progress)


def _detector(data: Path, epochs: int, minutes: float | None, workers: int) -> dict[str, Any]:
    from services.doctor.checks import training_remedy
    from services.perception.detection.detector import default_weights

    if find_spec("torch") is None or find_spec("onnx") is None:
        raise MissingComponentError(f"training needs torch and onnx: {training_remedy()}")
    _render(data, workers)
    from services.perception.training.detector.train import train_detector

    return train_detector(
        data, default_weights.parent, epochs=epochs, minutes=minutes, threads=workers
    )


def _render(data: Path, workers: int) -> None:
    from sim.dataset import COUNTS, write_sets_visibly

    write_sets_visibly(data, COUNTS, seed=0, workers=workers)
