"""Reading and writing learned weights as small, diffable text."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from services.grounding.behavior import PAIR_FEATURES
from services.grounding.dcg import Weights
from services.grounding.errors import GroundingError
from services.grounding.features import FactorFeatures

WEIGHTS = Path(__file__).parent / "weights"
DECIMALS = 3

Rows = dict[str, dict[str, float]]
"""{language feature: {attribute or match: weight}}, zeros left out."""


@dataclass(frozen=True)
class ModelWeights:
    """Everything that is learned for one robot."""

    factors: Weights
    """Of the factors over symbols."""
    rules: Weights | None
    """Of the factors over rules, for a robot whose symbols are pruned (HDCG)."""
    pairs: NDArray[np.float64]
    """Weight of each of `PAIR_FEATURES`."""
    temperature: float
    """What divides the log probabilities of readings, so that they are calibrated."""


def weights_path(robot: str) -> Path:
    """Where a robot's weights are kept."""
    return WEIGHTS / f"{robot}.json"


def save_weights(
    path: Path, weights: ModelWeights, factors: FactorFeatures, rules: FactorFeatures
) -> None:
    """Writes the weights by the names of their features."""
    pairs = zip(PAIR_FEATURES, weights.pairs.round(DECIMALS).tolist(), strict=True)
    named = {"factors": _named_rows(weights.factors, factors)}
    if weights.rules:
        named["rules"] = _named_rows(weights.rules, rules)
    parts = [
        f'"temperature": {round(weights.temperature, DECIMALS)}',
        f'"pairs": {json.dumps(dict(pairs))}',
        *(f'"{key}": {{\n{_lines(rows)}\n}}' for key, rows in named.items()),
    ]
    path.write_text("{" + ",\n".join(parts) + "}\n", encoding="utf-8")


def _named_rows(weights: Weights, features: FactorFeatures) -> Rows:
    rows = {
        name: _named(weights.static[row], features.attributes)
        | _named(weights.match[row], features.match_names)
        for name, row in weights.language.items()
    }
    return {name: row for name, row in rows.items() if row}


def _named(row: NDArray[np.float64], names: tuple[str, ...]) -> dict[str, float]:
    values = zip(names, row.round(DECIMALS).tolist(), strict=True)
    return {name: value for name, value in values if value}


def _lines(rows: Rows) -> str:
    return ",\n".join(f"  {json.dumps(name)}: {json.dumps(row)}" for name, row in rows.items())


def load_weights(path: Path, factors: FactorFeatures, rules: FactorFeatures) -> ModelWeights:
    """Reads what `save_weights` wrote.

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
    return ModelWeights(
        factors=_weights(document["factors"], factors, path.name),
        rules=_weights(document["rules"], rules, path.name) if "rules" in document else None,
        pairs=np.array([document["pairs"].get(name, 0.0) for name in PAIR_FEATURES]),
        temperature=document["temperature"],
    )


def _weights(rows: Rows, features: FactorFeatures, file: str) -> Weights:
    column = {name: at for at, name in enumerate((*features.attributes, *features.match_names))}
    matrix = np.zeros((len(rows), len(column)))
    for at, row in enumerate(rows.values()):
        unknown = [name for name in row if name not in column]
        if unknown:
            raise GroundingError(f"{file} names unknown features: {', '.join(sorted(unknown))}")
        matrix[at, [column[name] for name in row]] = list(row.values())
    language = {name: at for at, name in enumerate(rows)}
    statics = len(features.attributes)
    return Weights(language, matrix[:, :statics], matrix[:, statics:])
