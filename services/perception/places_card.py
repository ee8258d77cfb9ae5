"""What is known about the weights of the classifier of places: the JSON document beside them."""

from pathlib import Path

import msgspec
from msgspec import Struct

from schemas.errors import MissingComponentError
from services.perception.calibration import ReliabilityBin
from services.perception.card import card_path, file_sha256
from services.perception.errors import PerceptionError

_remedy = "`incognita train places` makes it"


class MissingPlacesError(PerceptionError, MissingComponentError):
    """The weights or their card are missing or do not belong together."""


class PlaceFigures(Struct, frozen=True, kw_only=True):
    """How good one output is on rooms that took no part in training or fitting."""

    accuracy: float
    """Share of looks whose likeliest type is the true one."""
    accuracy_of: dict[str, float]
    """The same for each true type."""
    surprise: float
    """Mean negative logarithm of the probability of the true type [nat]."""
    reliability: tuple[ReliabilityBin, ...]
    """Of the probability of the likeliest type."""
    calibration_error: float
    looks: int


class PlacesCard(Struct, frozen=True, kw_only=True):
    """What the weights are, where they come from, and how good they were on held-out rooms."""

    types: tuple[str, ...]
    """In the order of the network's outputs."""
    sha256: str
    """Of the weight file."""
    licence: str
    data: str
    """How the training pictures were made."""
    training_pictures: int
    validation_pictures: int
    seed: int
    windows_seen: int
    """In training, augmented ones counted anew."""
    parameters: int
    here_temperature: float = 1.0
    """Of the logits of the place that the camera is in."""
    ahead_temperature: float = 1.0
    """Of the logits of the place that a window's middle shows."""
    pooling: float = 1.0
    """Windows of one picture are alike: K of them weigh K^(1 - pooling) times one."""
    here: PlaceFigures | None = None
    """By whole pictures; None before they were measured."""
    ahead: PlaceFigures | None = None
    """By windows whose point lies in a room."""
    through_doors: PlaceFigures | None = None
    """As `ahead`, of those alone whose point lies in another room than the camera."""


def read_places_card(weights: Path) -> PlacesCard:
    """Read the card and check that it belongs to the weights.

    Raises:
        MissingPlacesError: weights or card are missing or malformed, or do not belong together.
    """
    path = card_path(weights)
    for needed in (weights, path):
        if not needed.is_file():
            raise MissingPlacesError(
                f"the classifier of places needs {needed}, which is missing; {_remedy}"
            )
    try:
        card = msgspec.json.decode(path.read_bytes(), type=PlacesCard)
    except msgspec.DecodeError as error:
        raise MissingPlacesError(
            f"{path} is not a card of a classifier of places: {error}"
        ) from error
    found = file_sha256(weights)
    if found != card.sha256:
        raise MissingPlacesError(
            f"{weights} (SHA-256 {found[:12]}) is not what {path.name} describes "
            f"({card.sha256[:12]}); {_remedy}"
        )
    return card


def write_places_card(card: PlacesCard, weights: Path) -> None:
    """Write the card beside its weights."""
    text = msgspec.json.format(msgspec.json.encode(card), indent=1)
    card_path(weights).write_bytes(text + b"\n")
