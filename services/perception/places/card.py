"""What is known about the weights of the classifier of places: the JSON document beside them."""

from pathlib import Path

from msgspec import Struct

from services.perception.detection.calibration import ReliabilityBin
from services.perception.weight_files import read_card_as


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
    """Read the card of a classifier of places and check that it belongs to the weights.

    Raises:
        MissingWeightsError: weights or card are missing or malformed, or do not belong together.
    """
    return read_card_as(PlacesCard, weights, "places")
