"""Names of a network's classes, in the order of its outputs."""

import ast
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from services.perception.errors import DetectorFileError

_key = "names"
"""Under which exporters note the names: a dict of Python, number to name, or a list."""


def read_class_names(path: Path) -> tuple[str, ...]:
    """Names in a text file, one a line, or in a JSON file, as a list.

    A name may come twice: the classes are then one.

    Raises:
        DetectorFileError: the file cannot be read, names nothing, or has a gap.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DetectorFileError(f"cannot read class names from {path}: {error}") from error
    names = _listed(text, path) if text.lstrip().startswith("[") else _lines(text)
    if "" in names:
        raise DetectorFileError(
            f"{path}: name {names.index('') + 1} of {len(names)} is empty; "
            "every class of the network needs one, in the order of its outputs"
        )
    if not names:
        raise DetectorFileError(f"{path} names no class; allowed: one name a line, or a JSON list")
    return names


def names_in_metadata(metadata: Mapping[str, str]) -> tuple[str, ...]:
    """Names that the exporter noted in the file; none if it noted none."""
    try:
        noted: Any = ast.literal_eval(metadata.get(_key, "[]"))
    except (ValueError, SyntaxError):
        return ()
    if isinstance(noted, dict):
        noted = [noted[number] for number in sorted(noted)]
    return tuple(str(name) for name in noted) if isinstance(noted, list) else ()


def _lines(text: str) -> tuple[str, ...]:
    return tuple(line.strip() for line in text.rstrip().splitlines())


def _listed(text: str, path: Path) -> tuple[str, ...]:
    try:
        return tuple(name.strip() for name in msgspec.json.decode(text, type=list[str]))
    except msgspec.DecodeError as error:
        raise DetectorFileError(f"{path} is not a JSON list of names: {error}") from error
