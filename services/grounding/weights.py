"""Reading and writing learned weights as small, diffable text."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from services.grounding.dcg import Weights
from services.grounding.errors import GroundingError
from services.grounding.features import MATCHES
from services.grounding.symbols import SymbolTable

WEIGHTS = Path(__file__).parent / "weights"
DECIMALS = 3


def weights_path(robot: str) -> Path:
    """Where a robot's weights are kept."""
    return WEIGHTS / f"{robot}.json"


def save_weights(path: Path, weights: Weights, table: SymbolTable, extra: dict[str, Any]) -> None:
    """Writes {language feature: {attribute or match: weight}} and `extra`; zeros are left out."""
    rows = {
        name: _named(weights.static[row], table.attributes) | _named(weights.match[row], MATCHES)
        for name, row in weights.language.items()
    }
    lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(row)}" for name, row in rows.items())
    body = "".join(f"{json.dumps(key)}: {json.dumps(value)},\n" for key, value in extra.items())
    path.write_text(f'{{{body}"factors": {{\n{lines}\n}}}}\n', encoding="utf-8")


def _named(row: NDArray[np.float64], names: tuple[str, ...]) -> dict[str, float]:
    values = zip(names, row.round(DECIMALS).tolist(), strict=True)
    return {name: value for name, value in values if value}


def load_weights(path: Path, table: SymbolTable) -> tuple[Weights, dict[str, Any]]:
    """Reads what `save_weights` wrote; returns the factors' weights and the extra items.

    Raises:
        GroundingError: there is no such file, or it names features that this version lacks.
    """
    if not path.exists():
        known = sorted(file.stem for file in path.parent.glob("*.json") if "." not in file.stem)
        raise GroundingError(
            f"no grounding weights at {path}; weights exist for: {', '.join(known) or 'no robot'}; "
            f"make them with: incognita train grounding --robot {path.stem}"
        )
    document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    factors: dict[str, dict[str, float]] = document.pop("factors")
    static = _matrix(factors, table.attributes)
    match = _matrix(factors, MATCHES)
    unknown = {name for row in factors.values() for name in row} - {*table.attributes, *MATCHES}
    if unknown:
        raise GroundingError(f"{path.name} names unknown features: {', '.join(sorted(unknown))}")
    return Weights({name: row for row, name in enumerate(factors)}, static, match), document


def _matrix(factors: dict[str, dict[str, float]], names: tuple[str, ...]) -> NDArray[np.float64]:
    return np.array([[row.get(name, 0.0) for name in names] for row in factors.values()])
