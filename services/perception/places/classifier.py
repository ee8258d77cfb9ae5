"""What kinds of places a picture shows, by a small network that OpenCV runs on one core.

The network says two things about every window: in what kind of place the camera is, and what kind
its middle shows, which through a doorway is another. The first is pooled over the windows and
speaks of where the robot stands; the second speaks of the windows' points ahead.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Floats
from schemas.perception import SceneObservation
from schemas.sensing import RgbdFrame
from services.perception.detection.detector import Network
from services.perception.places.card import PlacesCard, read_places_card
from services.perception.places.windows import network_input, points_ahead, window_pictures
from services.perception.space.rays import camera_rays, depth_metres

default_places = Path(__file__).parent.parent / "weights" / "places.onnx"
_least_ahead = 0.6
"""What is nearer is where the robot stands [m]."""


@dataclass(frozen=True)
class PlaceLogits:
    """What the network says about the K windows of a picture."""

    here: Floats
    """(K, T)"""
    ahead: Floats
    """(K, T)"""


class PlaceClassifier:
    """Tells the types of places of its card apart.

    Raises:
        MissingWeightsError: weights or card are missing or do not belong together.
    """

    def __init__(self, weights: Path = default_places) -> None:
        self.card: PlacesCard = read_places_card(weights)
        self._network = Network(weights)
        # The first forward pass allocates and packs weights: not while a robot waits for it.
        self.logits(np.zeros((120, 160, 3), np.uint8))

    def logits(self, color: NDArray[np.uint8]) -> PlaceLogits:
        """Logits of an RGB picture (H, W, 3)."""
        return self.window_logits(window_pictures(color))

    def window_logits(self, windows: NDArray[np.uint8]) -> PlaceLogits:
        """Logits of windows (K, 120, 160, 3) that were cut and made small."""
        outputs = [np.ravel(self._network(network_input(one))) for one in windows]
        both = np.asarray(outputs, np.float64).reshape(len(windows), 2, -1)
        return PlaceLogits(both[:, 0], both[:, 1])

    def distributions(self, color: NDArray[np.uint8]) -> tuple[Floats, Floats]:
        """Calibrated type distributions of where the camera is (T,), and ahead (K, T)."""
        logits, card = self.logits(color), self.card
        here = pooled(logits.here, card.here_temperature, card.pooling)
        return here, softmax(logits.ahead / card.ahead_temperature)


def scene_in(
    frame: RgbdFrame, classifier: PlaceClassifier, types: tuple[str, ...]
) -> SceneObservation:
    """Kinds of places that a frame shows, among the types that matter.

    Without depth the windows have no points, and only the place of the camera is spoken of.
    """
    here, ahead = classifier.distributions(frame.color)
    points = points_ahead(
        depth_metres(frame.depth_mm), camera_rays(frame.intrinsics, frame.base_from_camera)
    )
    # Comparisons with what is not a number are false: windows without depth are left out.
    told = np.hypot(*points.T) > _least_ahead
    return SceneObservation(
        stamp_ns=frame.stamp_ns,
        types=types,
        odom_from_base=frame.odom_from_base,
        points_base=np.concatenate([np.zeros((1, 2)), points[told]]),
        probabilities=among(np.vstack([here, ahead[told]]), classifier.card.types, types),
    )


def pooled(logits: Floats, temperature: float, pooling: float) -> Floats:
    """One distribution (T,) of the logits (K, T) of the windows of one picture."""
    weight = len(logits) ** -pooling / temperature
    return softmax(weight * logits.sum(axis=0))


def softmax(logits: Floats) -> Floats:
    """Distributions over the last axis (..., T)."""
    powers = np.exp(logits - logits.max(axis=-1, keepdims=True))
    return powers / powers.sum(axis=-1, keepdims=True)


def among(probabilities: Floats, known: tuple[str, ...], types: tuple[str, ...]) -> Floats:
    """Distributions (N, T) given that the place is of one of some types.

    Args:
        probabilities: (N, C) over the known types, under even odds.
        known: C names.
        types: T names; one that is not known gets the even odds that its look would have.
    """
    table = np.full((len(probabilities), len(types)), 1 / len(known))
    for column, name in enumerate(types):
        if name in known:
            table[:, column] = probabilities[:, known.index(name)]
    return table / table.sum(axis=1, keepdims=True)
