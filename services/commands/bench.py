"""The verb that runs experiments and prints our figures beside the paper's."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import tyro

from schemas.errors import UserError
from services.commands.detectors import chosen
from services.commands.output import print_json, print_table, say

if TYPE_CHECKING:
    from sim.experiments.report import Report, Settings

ALL, PERCEPTION = "all", "perception"


@dataclass(frozen=True)
class Bench:
    """One experiment: what measures it and what draws it, `module:function` in sim/experiments."""

    measure: str
    runs: int
    """Runs unless others are asked for."""
    draw: str = "bench_figures:draw_rows"


BENCHES: dict[str, Bench] = {
    "table1": Bench("table1:measure", 100, "table1:draw"),
    "table2": Bench("table2:measure", 100, "table2:draw"),
    "table5": Bench("table5:measure", 100, "table5:draw"),
    "ablations": Bench("bench_ablations:measure", 100),
    "adaptive": Bench("bench_adaptive:measure", 5),
    "belief": Bench("bench_belief:measure", 1, "bench_belief:draw"),
    "fov": Bench("fov:measure", 50, "fov:draw"),
    "grounding": Bench("bench_grounding:measure", 10),
    "grounding_scaling": Bench(
        "bench_grounding_scaling:measure", 30, "bench_grounding_scaling:draw"
    ),
    "grounding_training": Bench("bench_grounding_training:measure", 1),
    "log": Bench("bench_suites:measure_log", 15),
    "mapping": Bench("bench_suites:measure_mapping", 15, "bench_mapping:draw"),
    "perception": Bench("perception.bench:measure", 1000),
    "runtime": Bench("bench_suites:measure_runtime", 25),
}


def bench(
    name: Annotated[str, tyro.conf.Positional],
    runs: int | None = None,
    workers: int = 1,
    cluster: tuple[str, ...] | None = None,
    seed: int = 0,
    json: bool = False,
    plot: Path | None = None,
    keep: Path | None = None,
    images: Path | None = None,
    detector: tuple[Path, ...] = (),
    classes: tuple[Path, ...] = (),
) -> int:
    """Run an experiment; our figures stand beside the paper's.

    Args:
        name: table1, table2, table5, ablations, adaptive, belief, fov, grounding,
            grounding_scaling, grounding_training, log, mapping, perception, runtime, or all.
        runs: how often each thing is tried or timed; by default as many as the experiment wants.
        workers: processes that may work at once; what measures time uses one.
        cluster: spread episodes with Ray: over the cluster at an address (HOST:PORT, ray://HOST:PORT
            or auto), without an address over this machine. Same seeds, same results.
        seed: decides every random choice.
        json: one JSON document on stdout.
        plot: folder for the document, the rows (CSV) and the figure (PNG).
        keep: file for the result of every episode; those in it that the same revision of the code
            made are not run again, so that what was interrupted goes on.
        images: for perception: a folder of your own pictures instead of rendered ones; nothing is
            known of them, so that times and what was found are told.
        detector: for perception: ONNX files of other networks; several work as one.
        classes: a file with the class names of each, where they do not say them themselves.
    """
    from sim.experiments.report import Settings

    names = _chosen(name, runs, workers)
    if name != PERCEPTION and (images or detector or classes):
        raise UserError(f"--images, --detector and --classes go with perception, not with {name}")
    detectors, detector_classes = chosen(detector, classes)
    settings = Settings(
        runs=runs or 0,
        workers=workers,
        seed=seed,
        progress=say,
        cluster=_address(cluster),
        keep=keep,
        detectors=detectors,
        detector_classes=detector_classes,
        images=images,
    )
    reports = [_run(one, settings, plot) for one in names]
    if json:
        documents = [msgspec.to_builtins(report) for report in reports]
        print_json({"bench": ALL, "benches": documents} if name == ALL else documents[0])
    else:
        for report in reports:
            _print(report)
    return 0


def _chosen(name: str, runs: int | None, workers: int) -> list[str]:
    if name != ALL and name not in BENCHES:
        raise UserError(f"no bench {name!r}; benches are: {', '.join(BENCHES)}, {ALL}")
    for option, value in (("--runs", runs), ("--workers", workers)):
        if value is not None and value < 1:
            raise UserError(f"{option} {value}; allowed: 1 or more")
    return list(BENCHES) if name == ALL else [name]


def _address(cluster: tuple[str, ...] | None) -> str | None:
    """Where the cluster is, "" for one that is started here, None for none."""
    if cluster is None:
        return None
    if len(cluster) > 1:
        raise UserError(f"--cluster {' '.join(cluster)}; allowed: one address, or none")
    from sim.experiments.spread import LOCAL, require_ray

    require_ray()
    return cluster[0] if cluster else LOCAL


def _run(name: str, asked: "Settings", plot: Path | None) -> "Report":
    from services.runtime.provenance import git_revision, machine_description
    from sim.experiments.report import Report

    wanted = BENCHES[name]

    def progress(doing: str) -> None:
        say(f"{name}: {doing}")

    settings = replace(asked, runs=asked.runs or wanted.runs, progress=progress)
    started = time.monotonic()
    found = _function(wanted.measure)(settings)
    report = Report(
        bench=name,
        seed=settings.seed,
        runs=settings.runs,
        git=git_revision(),
        machine=machine_description(),
        elapsed_s=round(time.monotonic() - started, 1),
        rows=found.rows,
        failures=found.failures,
        comparisons=found.comparisons,
        settings=found.settings,
    )
    if plot is not None:
        _write(report, plot, found.draw or _function(wanted.draw))
    return report


def _function(name: str) -> Callable[..., Any]:
    module, function = name.split(":")
    return getattr(import_module(f"sim.experiments.{module}"), function)


def _write(report: "Report", folder: Path, draw: "Callable[[Report, Path], None]") -> None:
    from sim.experiments.report import csv_text, json_text

    folder.mkdir(parents=True, exist_ok=True)
    target = folder / report.bench
    target.with_suffix(".json").write_text(json_text(report), encoding="utf-8")
    target.with_suffix(".csv").write_text(csv_text(report), encoding="utf-8")
    draw(report, target.with_suffix(".png"))
    say(f"{report.bench}: wrote {target}.json, .csv and .png")


def _print(report: "Report") -> None:
    from sim.experiments.report import (
        COMPARISON_HEAD,
        comparison_cells,
        failure_lines,
        table_of,
    )

    print_table(*table_of(report.rows))
    if report.comparisons:
        print_table(COMPARISON_HEAD, [comparison_cells(one) for one in report.comparisons])
    if failures := failure_lines(report):
        print("failures\n" + "\n".join(f"  {line}" for line in failures))
    for line in report.settings:
        print(line)
    print(f"{report.bench}: {report.runs} runs, {report.machine}, {report.elapsed_s:.0f} s")
