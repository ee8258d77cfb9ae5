"""What is known about a weight file: the JSON document beside it."""

import hashlib
from pathlib import Path

import msgspec
from msgspec import Struct

from services.perception.calibration import Calibration, ReliabilityBin
from services.perception.errors import MissingWeightsError
from services.perception.picture import Preprocessing, own_preprocessing


class DetectorCard(Struct, frozen=True, kw_only=True):
    """What the weights are, where they come from, and how good they were on held-out pictures."""

    classes: tuple[str, ...]
    """In the order of the network's outputs."""
    preprocessing: Preprocessing = own_preprocessing
    """What the network was trained to be shown."""
    threshold: float = 0.25
    """Working threshold: boxes of a lower score are noise, chosen on held-out pictures."""
    sha256: str
    """Of the weight file."""
    licence: str
    data: str
    """How the training pictures were made."""
    training_frames: int
    validation_frames: int
    """Threshold and calibration were fitted to these."""
    test_frames: int = 0
    """The figures are of these."""
    seed: int
    pictures_seen: int
    """In training, augmented ones counted anew."""
    parameters: int
    map50: float
    """Mean average precision at an overlap of 0.5, over the classes."""
    map50_95: float
    """Mean over the overlaps 0.5, 0.55 ... 0.95."""
    average_precision50: dict[str, float]
    """Of each class, at an overlap of 0.5."""
    average_precision50_95: dict[str, float] = {}
    """Of each class, the mean over the overlaps."""
    near_average_precision50: dict[str, float]
    """At an overlap of 0.5, of objects of at least `near_side` pixels; others have no depth."""
    precision: float = 0.0
    """Share of the boxes that reach the working threshold that are right."""
    recall: float = 0.0
    """Share of the objects that are found at the working threshold."""
    empty_frames: int = 0
    """Pictures of other things alone."""
    false_per_hundred: float = 0.0
    """Boxes that reach the working threshold in a hundred of those."""
    calibration: Calibration
    reliability: tuple[ReliabilityBin, ...]
    """Of the probability of the named class, on pictures that took no part in fitting it."""
    calibration_error: float


def card_path(weights: Path) -> Path:
    """Where the card of a weight file lies."""
    return weights.with_suffix(".json")


def read_card(weights: Path) -> DetectorCard:
    """Read the card and check that it belongs to the weights.

    Raises:
        MissingWeightsError: weights or card are missing or malformed, or do not belong together.
    """
    path = card_path(weights)
    for needed in (weights, path):
        if not needed.is_file():
            raise MissingWeightsError(
                f"the detector needs {needed}, which is missing; "
                "`incognita train detector` makes it"
            )
    try:
        card = msgspec.json.decode(path.read_bytes(), type=DetectorCard)
    except msgspec.DecodeError as error:
        raise MissingWeightsError(f"{path} is not a detector card: {error}") from error
    found = file_sha256(weights)
    if found != card.sha256:
        raise MissingWeightsError(
            f"{weights} (SHA-256 {found[:12]}) is not what {path.name} describes "
            f"({card.sha256[:12]}); `incognita train detector` makes both again"
        )
    return card


def is_card(path: Path) -> bool:
    """Whether a JSON file describes weights of ours; people describe their own otherwise."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=dict[str, object]).keys() >= {"sha256"}
    except msgspec.DecodeError:
        return False


def write_card(card: DetectorCard, weights: Path) -> None:
    """Write the card beside its weights."""
    text = msgspec.json.format(msgspec.json.encode(card), indent=1)
    card_path(weights).write_bytes(text + b"\n")


def file_sha256(path: Path) -> str:
    """Hexadecimal digest of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
