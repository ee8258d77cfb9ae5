"""The committed figures, and how far a new run is from them."""

import os
from pathlib import Path

import msgspec
from msgspec import Struct

from services.runtime.provenance import git_revision, machine_description
from tests.benchmarks.rows import Peer, Row

FILE = Path(__file__).parent / "baseline.json"


class Figure(Struct, frozen=True, kw_only=True):
    """One row as it was blessed. Only `ratio` is compared; the rest is for reference."""

    unit: str
    ours: float
    peer: Peer | None
    ratio: float | None
    machine: str
    git: str


Baseline = dict[str, Figure]


def load() -> Baseline:
    """Figures by the key of their row; none if nothing was blessed yet."""
    return msgspec.json.decode(FILE.read_bytes(), type=Baseline) if FILE.exists() else {}


def bless(rows: list[Row]) -> None:
    """Write these rows over what the file says about them; others stay."""
    machine, git = machine_with_load(), git_revision()
    figures = load() | {
        row.key: Figure(
            unit=row.unit,
            ours=_rounded(row.ours),
            peer=Peer(row.peer.name, _rounded(row.peer.value)) if row.peer else None,
            ratio=_rounded(row.ratio) if row.ratio is not None else None,
            machine=machine,
            git=git,
        )
        for row in rows
    }
    FILE.write_bytes(msgspec.json.format(msgspec.json.encode(figures), indent=1) + b"\n")


def complaint(row: Row, baseline: Baseline) -> str | None:
    """What is wrong with a row, or None."""
    if row.key not in baseline:
        return f"{row.key}: no baseline; bless one with python -m tests.benchmarks --bless"
    if not row.within_limit:
        return f"{row.key}: {row.ours:g} {row.unit}, allowed is {row.limit:g}"
    blessed = baseline[row.key].ratio
    if row.drift is None or blessed is None:
        return None
    worsening = row.worsening(blessed)
    if worsening <= row.drift:
        return None
    return (
        f"{row.key}: ratio {row.ratio:.3g} is {worsening:.1f} times worse than the baseline's "
        f"{blessed:.3g}, allowed is {row.drift:g} times"
    )


def machine_with_load() -> str:
    """The machine, and how busy it is."""
    return f"{machine_description()}, load {os.getloadavg()[0]:.1f}"


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
