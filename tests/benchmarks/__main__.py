"""`python -m tests.benchmarks [NAMES] [--rounds N] [--json] [--bless]`."""

import argparse
import sys
import time
from importlib import import_module

import msgspec

from schemas.errors import MissingComponentError
from services.runtime.provenance import git_revision
from sim import vulkan
from tests.benchmarks import baseline
from tests.benchmarks.rows import Row

BENCHMARKS: dict[str, int] = {
    "wire": 25,
    "codec": 51,
    "shader": 15,
    "camera": 25,
    "detector": 51,
    "fiducials": 25,
    "manipulation": 25,
    "startup": 5,
    "mapping": 15,
    "mapping_growth": 15,
    "log": 15,
}
"""Module below this package, and its rounds unless asked for others."""
DRAWING = {"shader", "camera", "fiducials", "startup"}
"""Those that need a Vulkan device."""

_head = ("metric", "ours", "95 %", "peer", "ratio", "baseline ratio")
_missing_component = 5


def run(names: list[str], rounds: int | None) -> list[Row]:
    """Rows of the named benchmarks, one benchmark after the other.

    Raises:
        NoVulkanDeviceError: one of them draws, and there is no device for that.
    """
    vulkan.activate()
    if DRAWING.intersection(names):
        vulkan.device_name()
    rows: list[Row] = []
    for name in names:
        print(f"benchmark {name} ...", file=sys.stderr, flush=True)
        # Imported when its turn comes: sapien must find the driver that was activated above.
        rows += import_module(f"tests.benchmarks.{name}").measure(rounds or BENCHMARKS[name])
    return rows


def table(rows: list[Row], blessed: baseline.Baseline) -> str:
    """The rows under a head, columns aligned."""
    lines = [_head, *(_cells(row, blessed) for row in rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(_head))]
    return "\n".join(
        " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )


def _cells(row: Row, blessed: baseline.Baseline) -> tuple[str, ...]:
    before = blessed.get(row.key)
    return (
        f"{row.row}, {row.metric} [{row.unit}]",
        f"{row.ours:.3g}",
        f"{row.interval[0]:.3g} .. {row.interval[1]:.3g}",
        f"{row.peer.value:.3g} {row.peer.name}" if row.peer else "",
        _number(row.ratio),
        _number(before.ratio if before else None),
    )


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"


def document(names: list[str], rounds: int | None, rows: list[Row], elapsed_s: float) -> bytes:
    """What --json prints: the shape of `incognita bench --json`."""
    content = {
        "bench": " ".join(names),
        "seed": 0,
        "runs": rounds or {name: BENCHMARKS[name] for name in names},
        "git": git_revision(),
        "machine": baseline.machine_with_load(),
        "elapsed_s": round(elapsed_s, 1),
        "rows": rows,
    }
    return msgspec.json.format(msgspec.json.encode(content), indent=1)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(BENCHMARKS))
    parser.add_argument("--rounds", type=int, help="turns that each contender has")
    parser.add_argument("--json", action="store_true", help="one JSON document, not a table")
    parser.add_argument("--bless", action="store_true", help="make this run the baseline")
    given = parser.parse_args()
    names: list[str] = given.names or list(BENCHMARKS)
    if unknown := [name for name in names if name not in BENCHMARKS]:
        parser.error(f"no benchmark {unknown[0]!r}; benchmarks are: {', '.join(BENCHMARKS)}")
    if given.rounds is not None and given.rounds < 1:
        parser.error(f"--rounds {given.rounds}: at least 1")
    started = time.monotonic()
    try:
        rows = run(names, given.rounds)
    except MissingComponentError as error:
        print(error, file=sys.stderr)
        return _missing_component
    elapsed_s = time.monotonic() - started
    if given.json:
        print(document(names, given.rounds, rows, elapsed_s).decode())
    else:
        print(table(rows, baseline.load()))
        print(f"{baseline.machine_with_load()}, {elapsed_s:.0f} s")
    if given.bless:
        baseline.bless(rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
