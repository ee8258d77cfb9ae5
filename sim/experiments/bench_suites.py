"""The speed suites of `tests.benchmarks` as experiments."""

from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import msgspec

from schemas.errors import MissingComponentError
from sim.experiments.report import Outcome, Row, Settings

SUITES = {
    "runtime": ["wire", "codec", "startup"],
    "mapping": ["mapping", "mapping_growth"],
    "log": ["log"],
}
"""Benchmarks of each part."""


def measure_runtime(settings: Settings) -> Outcome:
    """Messages between processes, their coding, and starting up."""
    return _measure("runtime", settings)


def measure_mapping(settings: Settings) -> Outcome:
    """Steps of the filter and decisions, and how they grow."""
    return _measure("mapping", settings)


def measure_log(settings: Settings) -> Outcome:
    """Recording, what a kill loses, and opening large files."""
    return _measure("log", settings)


def _measure(suite: str, settings: Settings) -> Outcome:
    settings.progress(", ".join(SUITES[suite]))
    return Outcome(suite_rows(SUITES[suite], settings.runs))


def suite_rows(names: Sequence[str], rounds: int) -> tuple[Row, ...]:
    """Rows of benchmarks, each contender having so many turns.

    Raises:
        MissingComponentError: the benchmarks, what they compare with, or a device to draw with.
    """
    if find_spec("tests") is None or find_spec("tests.benchmarks") is None:
        raise MissingComponentError("tests/benchmarks is missing: run this from a checkout")
    runner: Any = import_module("tests.benchmarks.__main__")
    try:
        measured = runner.run(list(names), rounds)
    except ModuleNotFoundError as error:
        raise MissingComponentError(
            f"{', '.join(names)}: compared with {error.name}, which is not installed here; "
            "the environment of './incognita test' has it"
        ) from error
    return msgspec.convert([_contract(row) for row in measured], tuple[Row, ...])


def _contract(row: object) -> dict[str, Any]:
    """The fields that a row of the contract has."""
    return {
        name: value
        for name, value in msgspec.to_builtins(row).items()
        if name in Row.__struct_fields__
    }
