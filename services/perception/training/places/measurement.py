"""Fills in the card of a classifier of places: calibration and figures, measured through OpenCV.

Calibration is fitted on one half of the held-out rooms and judged on the other. Types count evenly:
of each as many looks are taken as the rarest has.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from schemas.arrays import Flags, Floats, Ints
from services.perception.detection.calibration import calibration_error, reliability
from services.perception.places.card import PlaceFigures, PlacesCard
from services.perception.places.classifier import PlaceClassifier, pooled, softmax
from services.perception.training.places.frames import PlacePicture
from services.perception.weight_files import write_card

_least = 1e-6
_poolings = np.linspace(0.0, 1.0, 11)
_temperatures = np.exp(np.linspace(np.log(0.4), np.log(4.0), 47))
_fewest = 5
"""Types with fewer looks are left out of a figure; they would decide it."""


@dataclass(frozen=True)
class Looks:
    """What was said about L pictures, and what is true."""

    here: Floats
    """(L, K, T) logits."""
    ahead: Floats
    """(L, K, T) logits."""
    true_here: Ints
    """(L,)"""
    true_ahead: Ints
    """(L, K)"""

    def __getitem__(self, index: slice) -> "Looks":
        return Looks(
            self.here[index], self.ahead[index], self.true_here[index], self.true_ahead[index]
        )

    @property
    def windows(self) -> tuple[Floats, Ints]:
        """Logits (L K, T) of what lies ahead, and the truth."""
        return self.ahead.reshape(-1, self.ahead.shape[2]), self.true_ahead.reshape(-1)

    @property
    def elsewhere(self) -> Flags:
        """(L K,) whether a window shows another place than the camera is in."""
        return (
            (self.true_ahead != self.true_here[:, None]) & (self.true_here[:, None] >= 0)
        ).reshape(-1)

    def pooled(self, temperature: float, pooling: float) -> Floats:
        """Distributions (L, T) of the place of the camera."""
        return np.array([pooled(logits, temperature, pooling) for logits in self.here])


def measured_places(card: PlacesCard, weights: Path, held_out: list[PlacePicture]) -> PlacesCard:
    """Fill in calibration and figures, and write the card."""
    write_card(card, weights)
    looks = looks_at(PlaceClassifier(weights), held_out)
    # Pictures of one suite follow one another: halves share no rooms.
    half = len(held_out) // 2
    card = fitted(card, looks[:half])
    rest = looks[half:]
    here = rest.pooled(card.here_temperature, card.pooling)
    logits, true_ahead = rest.windows
    ahead = softmax(logits / card.ahead_temperature)
    through = np.where(rest.elsewhere, true_ahead, -1)
    card = msgspec.structs.replace(
        card,
        validation_pictures=len(held_out),
        here=figures(card.types, here, rest.true_here),
        ahead=figures(card.types, ahead, true_ahead),
        through_doors=figures(card.types, ahead, through),
    )
    write_card(card, weights)
    return card


def looks_at(classifier: PlaceClassifier, pictures: list[PlacePicture]) -> Looks:
    """Run the classifier over the windows of pictures."""
    said = [classifier.window_logits(picture.windows) for picture in pictures]
    return Looks(
        here=np.array([one.here for one in said]),
        ahead=np.array([one.ahead for one in said]),
        true_here=np.array([picture.here for picture in pictures], np.int32),
        true_ahead=np.array([picture.ahead for picture in pictures], np.int32),
    )


def fitted(card: PlacesCard, looks: Looks) -> PlacesCard:
    """The card with the calibration that surprises least."""
    here = even(looks.true_here)
    temperature, pooling = min(
        ((t, p) for t in _temperatures.tolist() for p in _poolings.tolist()),
        key=lambda both: surprise(looks.pooled(*both)[here], looks.true_here[here]),
    )
    logits, truth = looks.windows
    ahead = even(truth)
    best = _least_surprising(lambda t: softmax(logits[ahead] / t), truth[ahead])
    return msgspec.structs.replace(
        card, here_temperature=temperature, pooling=pooling, ahead_temperature=best
    )


def figures(types: tuple[str, ...], probabilities: Floats, truth: Ints) -> PlaceFigures:
    """Figures of distributions (L, T) for true types (L,), -1 for none."""
    known = truth >= 0
    right = probabilities.argmax(axis=1) == truth
    chosen = even(truth)
    best = probabilities.max(axis=1)
    table = reliability(best[chosen], right[chosen])
    return PlaceFigures(
        accuracy=float(right[chosen].mean()) if len(chosen) else 0.0,
        accuracy_of={
            name: float(right[truth == index].mean())
            for index, name in enumerate(types)
            if (truth == index).any()
        },
        surprise=surprise(probabilities[chosen], truth[chosen]),
        reliability=tuple(table),
        calibration_error=calibration_error(table),
        looks=int(known.sum()),
    )


def even(truth: Ints) -> Ints:
    """Indices of looks, as many of each type; always the same."""
    rng = np.random.default_rng(0)
    count = np.bincount(truth[truth >= 0])
    rows = [np.flatnonzero(truth == kind) for kind in np.flatnonzero(count >= _fewest)]
    least = min((len(one) for one in rows), default=0)
    chosen = [rng.permutation(one)[:least] for one in rows]
    return np.sort(np.concatenate([np.zeros(0, np.int64), *chosen])).astype(np.int32)


def surprise(probabilities: Floats, truth: Ints) -> float:
    """Mean negative log probability of the truth [nat]."""
    if not len(truth):
        return 0.0
    likely = probabilities[np.arange(len(truth)), truth]
    return -float(np.log(likely + _least).mean())


def _least_surprising(distributions: Callable[[float], Floats], truth: Ints) -> float:
    return min(_temperatures.tolist(), key=lambda t: surprise(distributions(t), truth))
