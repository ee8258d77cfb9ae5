"""The report of a training: what it was made of, what came out, and a picture of its honesty."""

import platform
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl
import msgspec
import numpy as np
import torch
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from msgspec import Struct

from services.perception.detection.calibration import ReliabilityBin
from services.perception.detection.card import DetectorCard
from services.perception.training.detector.frames import Frame
from services.runtime.provenance import git_revision


class DataSet(Struct, frozen=True, kw_only=True):
    """What one set of labelled pictures holds."""

    frames: int
    objects: dict[str, int]
    """Of each class, those that are to be found."""
    ignored: int
    """Objects that are hardly to be seen."""
    made: dict[str, str]
    """What its shards say about how they were made."""


class TrainingReport(Struct, frozen=True, kw_only=True):
    """Everything that is needed to judge the weights, and to make them again."""

    git: str
    machine: str
    torch: str
    device: str
    seed: int
    pictures_seen: int
    cpu_minutes: float
    pictures_per_cpu_second: float
    losses: tuple[tuple[int, float], ...]
    """Pictures seen, and the mean loss since the row before."""
    data: dict[str, DataSet]
    card: DetectorCard


def data_set(folder: Path, frames: Sequence[Frame], classes: Sequence[str]) -> DataSet:
    """Describe the pictures that were read from a folder."""
    every = np.concatenate([frame.classes[~frame.ignored] for frame in frames])
    counts = np.bincount(every, minlength=len(classes)).tolist()
    return DataSet(
        frames=len(frames),
        objects=dict(zip(classes, counts, strict=True)),
        ignored=sum(int(frame.ignored.sum()) for frame in frames),
        made=_made(folder),
    )


def training_report(
    card: DetectorCard,
    data: Mapping[str, DataSet],
    device: str,
    cpu_s: float,
    losses: Sequence[tuple[int, float]],
) -> TrainingReport:
    """Gather what is known when a training ends."""
    return TrainingReport(
        git=git_revision(),
        machine=f"{platform.machine()}, {platform.system()}",
        torch=str(torch.__version__),
        device=device,
        seed=card.seed,
        pictures_seen=card.pictures_seen,
        cpu_minutes=round(cpu_s / 60, 1),
        pictures_per_cpu_second=round(card.pictures_seen / max(cpu_s, 1e-9), 1),
        losses=tuple(losses),
        data=dict(data),
        card=card,
    )


def write_report(report: TrainingReport, folder: Path) -> None:
    """Write `detector_report.json` and `detector_reliability.png`."""
    text = msgspec.json.format(msgspec.json.encode(report), indent=1)
    (folder / "detector_report.json").write_bytes(text + b"\n")
    draw_reliability(report.card, folder / "detector_reliability.png")


def draw_reliability(card: DetectorCard, path: Path) -> None:
    """Share of right boxes against the probability they were given, and how many there were."""
    # The same file for the same figures, whatever this machine has set.
    with mpl.rc_context(mpl.rcParamsDefault):
        figure = Figure(figsize=(4.5, 5.0), layout="constrained")
        upper, lower = figure.subplots(2, 1, height_ratios=(3, 1), sharex=True)
        upper.plot([0, 1], [0, 1], color="0.7", label="as promised")
        _draw_bins(upper, lower, card.reliability)
        upper.set(
            ylabel="share that was right",
            title=f"calibration error {card.calibration_error:.3f}, {card.test_frames} pictures",
        )
        lower.set(xlabel="probability given", ylabel="boxes", yscale="log")
        upper.legend(loc="upper left", frameon=False)
        figure.savefig(path, dpi=120, metadata={"Software": None})


def _draw_bins(upper: Axes, lower: Axes, table: Sequence[ReliabilityBin]) -> None:
    given = [row.probability for row in table]
    upper.plot(given, [row.frequency for row in table], "o-", color="C0", label="measured")
    lower.bar(given, [row.count for row in table], width=0.06, color="C0")


def _made(folder: Path) -> dict[str, str]:
    """Scalars of the first shard: all shards of a set were made the same way."""
    first = min((folder / "shards").glob("??????.npz"))
    with np.load(first) as arrays:
        return {name: str(arrays[name]) for name in arrays.files if arrays[name].ndim == 0}
