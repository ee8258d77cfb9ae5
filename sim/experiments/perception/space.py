"""Where objects are said to be, beside where they are: with the network's own boxes."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from schemas.arrays import Flags, Floats, Ints
from schemas.perception import Detections
from services.perception.training.detector.evaluation import matches
from services.perception.training.forms.measurement import small
from sim.experiments.perception.frames import KnownFrame

BANDS: tuple[tuple[float, float], ...] = ((0.3, 1.5), (1.5, 2.5), (2.5, 4.5), (4.5, 7.0))
"""Of the distance from the camera to the middle of an object [m]."""
WITHIN_95 = 7.815
"""What 95 % of a squared normalised error of three dimensions lie below."""


@dataclass(frozen=True)
class Placings:
    """M objects that were to be found, of the classes that the network knows."""

    pictures: Ints
    """(M,) which picture each is in."""
    ranges: Floats
    """(M,) from the camera to the middle [m]."""
    small: Flags
    """(M,) whether its longest side is at most 1.2 m: the middle of a car is far from its skin."""
    whole: Flags
    """(M,) whether the picture does not cut it: of what is cut off nobody knows the middle."""
    placed: Flags
    """(M,) whether it was found, named rightly and given a place."""
    errors: Floats
    """(M,) from its true middle to where it is said to be [m]; not a number where not placed."""
    squared: Floats
    """(M,) normalised squared error; likewise."""

    def selected(self, which: Flags) -> "Placings":
        """Those objects alone."""
        return Placings(*(getattr(self, field.name)[which] for field in fields(self)))

    def within(self, band: tuple[float, float]) -> Flags:
        """(M,) whether an object is in a band of ranges."""
        return (self.ranges >= band[0]) & (self.ranges < band[1])


def placings_in(picture: int, known: KnownFrame, said: Detections) -> Placings:
    """The objects of one picture that are asked for, and where they are said to be."""
    asked = np.array([label in said.classes for label in known.labels], np.bool_) & ~known.ignored
    rows = _rows_of(known, said, asked)
    placed = rows >= 0
    off = np.full((len(rows), 3), np.nan)
    off[placed] = said.centers_base[rows[placed]] - known.centers[asked][placed]
    eye = np.array(known.frame.base_from_camera.position)
    return Placings(
        pictures=np.full(len(rows), picture, np.int32),
        ranges=np.linalg.norm(known.centers[asked] - eye, axis=1),
        small=known.sizes[asked].max(axis=1, initial=0.0) <= small,
        whole=_is_whole(known.boxes[asked], known.frame.depth_mm.shape),
        placed=placed,
        errors=np.linalg.norm(off, axis=1),
        squared=_squared(off, said, rows),
    )


def joined(parts: Sequence[Placings]) -> Placings:
    """The objects of all pictures."""
    return Placings(
        *(np.concatenate([getattr(part, field.name) for part in parts])
          for field in fields(Placings))
    )  # fmt: skip


def _rows_of(known: KnownFrame, said: Detections, asked: Flags) -> Ints:
    """Row of `said` (M,) that is on each object that is asked for and names it rightly, else -1."""
    truth = np.flatnonzero(asked)
    labels = np.array([said.classes.index(known.labels[row]) for row in truth.tolist()], np.int32)
    rows = np.full(len(truth), -1, np.int32)
    best = said.probabilities.argmax(axis=1)
    for label in np.unique(labels).tolist():
        own, found = np.flatnonzero(labels == label), np.flatnonzero(best == label)
        on = matches(said.boxes_px[found], known.boxes[truth[own]], 0.5)
        rows[own[on[on >= 0]]] = found[on >= 0]
    return rows


def _squared(off: Floats, said: Detections, rows: Ints) -> Floats:
    values, placed = np.full(len(off), np.nan), rows >= 0
    own = off[placed]
    solved = np.linalg.solve(said.covariances[rows[placed]], own[..., None])[..., 0]
    values[placed] = (own * solved).sum(axis=1)
    return values


def _is_whole(boxes: Floats, shape: tuple[int, ...]) -> Flags:
    height, width = shape
    inside = (boxes[:, :2] > 1) & (boxes[:, 2:] < [width - 1, height - 1])
    return inside[:, 0] & inside[:, 1]
