"""A weight file of ours and the card beside it: a JSON document that says what it is."""

import hashlib
from pathlib import Path
from typing import Protocol, TypeVar

import msgspec

from services.perception.errors import MissingWeightsError


class WeightCard(Protocol):
    """What every card has."""

    @property
    def sha256(self) -> str:
        """Of the weight file."""
        ...


Card = TypeVar("Card", bound=WeightCard)


def card_path(weights: Path) -> Path:
    """Where the card of a weight file lies."""
    return weights.with_suffix(".json")


def read_card_as(card_type: type[Card], weights: Path, what: str) -> Card:
    """Read the card and check that it belongs to the weights.

    Args:
        card_type: What the card has to be.
        weights: The weight file; its card lies beside it.
        what: Whose weights they are, also the name of the command `train` that makes them.

    Raises:
        MissingWeightsError: weights or card are missing or malformed, or do not belong together.
    """
    path, remedy = card_path(weights), f"`incognita train {what}` makes both"
    for needed in (weights, path):
        if not needed.is_file():
            raise MissingWeightsError(f"{needed} is missing; {remedy}")
    try:
        card = msgspec.json.decode(path.read_bytes(), type=card_type)
    except msgspec.DecodeError as error:
        raise MissingWeightsError(f"{path} is not a card of {what}: {error}") from error
    found = file_sha256(weights)
    if found != card.sha256:
        raise MissingWeightsError(
            f"{weights} (SHA-256 {found[:12]}) is not what {path.name} describes "
            f"({card.sha256[:12]}); {remedy}"
        )
    return card


def write_card(card: WeightCard, weights: Path) -> None:
    """Write the card beside its weights."""
    text = msgspec.json.format(msgspec.json.encode(card), indent=1)
    card_path(weights).write_bytes(text + b"\n")


def file_sha256(path: Path) -> str:
    """Hexadecimal digest of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
