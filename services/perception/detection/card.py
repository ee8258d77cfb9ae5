"""What is known about a weight file: the JSON document beside it."""

from pathlib import Path

import msgspec
from msgspec import Struct

from services.perception.detection.calibration import Calibration, ReliabilityBin
from services.perception.detection.picture import Preprocessing, own_preprocessing
from services.perception.weight_files import read_card_as


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


def read_card(weights: Path) -> DetectorCard:
    """Read the card of a detector of ours and check that it belongs to the weights.

    Raises:
        MissingWeightsError: weights or card are missing or malformed, or do not belong together.
    """
    return read_card_as(DetectorCard, weights, "detector")


def is_card(path: Path) -> bool:
    """Whether a JSON file describes weights of ours; people describe their own otherwise."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=dict[str, object]).keys() >= {"sha256"}
    except msgspec.DecodeError:
        return False
