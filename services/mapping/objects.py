"""Things that the camera found: where, of what class, and whether they are there at all."""

from dataclasses import dataclass, fields

import numpy as np

from schemas.arrays import Floats, Ints
from services.mapping.backbone import Uncertainty

hit_limits = (-1.0, 1.2)
"""Most that one picture says for or against an object, in log odds: pictures are alike."""
existence_ceiling = 4.0
first_odds = -1.0
"""Before anything speaks for an object."""
_class_temper = 0.5
_class_floor = 0.02
_confirming_odds = 1.0
"""Out of reach of a single picture, see `hit_limits`."""


@dataclass
class TrackedObject:
    """One thing at one place; it is part of the map once it is `confirmed`."""

    number: int
    """Id for the run, -1 until confirmed."""
    mean: Floats
    """(2,), map frame [m]."""
    covariance: Floats
    """(2, 2) [m^2]"""
    extent: Floats
    """(3,) [m]"""
    class_log: Floats
    """(C,) log of the fused class distribution."""
    odds: float
    """Log odds that it exists."""
    hits: int
    seen_with: Uncertainty
    """Of the robot's pose at the last hit."""
    unseen: int = 0
    """Pictures since the last hit."""

    @property
    def confirmed(self) -> bool:
        """Whether it has entered the map."""
        return self.number >= 0

    @property
    def worthy(self) -> bool:
        """Whether enough consistent detections speak for it; a single one never does."""
        return self.odds >= _confirming_odds

    @property
    def class_probability(self) -> Floats:
        """(C,) fused class distribution."""
        return np.exp(self.class_log)

    @property
    def likeliest(self) -> int:
        """Class index."""
        return int(np.argmax(self.class_log))

    @property
    def radius(self) -> float:
        """Half of its mean width [m]."""
        return 0.25 * float(self.extent[0] + self.extent[1])

    def hit(self, class_probability: Floats, extent: Floats) -> None:
        """Fuse one detection's class distribution (C,) and extent (3,)."""
        self.hits += 1
        self.unseen = 0
        self.odds = min(self.odds + hit_log_odds(class_probability), existence_ceiling)
        self.class_log = fuse_classes(self.class_log, class_probability)
        self.extent = self.extent + (extent - self.extent) / min(self.hits, 10)


def hit_log_odds(class_probability: Floats) -> float:
    """What a detection says for existence: its mass on any class against `none`."""
    something = min(max(float(class_probability.sum()), 1e-3), 1 - 1e-3)
    return float(np.clip(np.log(something / (1 - something)), *hit_limits))


def fuse_classes(class_log: Floats, class_probability: Floats) -> Floats:
    """Product of distributions (C,) in logs, tempered because pictures are alike."""
    fused = class_log + _class_temper * np.log(np.maximum(class_probability, _class_floor))
    fused = fused - np.log(np.exp(fused - fused.max()).sum()) - fused.max()
    return np.maximum(fused, np.log(1e-4))


@dataclass(frozen=True)
class ObjectColumns:
    """The K confirmed objects as arrays, for the vectorised particle mathematics."""

    number: Ints
    """(K,)"""
    mean: Floats
    """(K, 2)"""
    covariance: Floats
    """(K, 2, 2)"""
    radius: Floats
    """(K,)"""
    half_extent: Floats
    """(K, 2) half the bounding box, map axes [m]."""
    class_log: Floats
    """(K, C)"""
    existence: Floats
    """(K,)"""


def columns(things: list[TrackedObject], classes: int) -> ObjectColumns:
    """Stack confirmed objects."""
    odds = np.array([thing.odds for thing in things])
    return ObjectColumns(
        number=np.array([thing.number for thing in things], np.int32),
        mean=np.array([thing.mean for thing in things]).reshape(-1, 2),
        covariance=np.array([thing.covariance for thing in things]).reshape(-1, 2, 2),
        radius=np.array([thing.radius for thing in things]),
        half_extent=0.5 * np.array([thing.extent[:2] for thing in things]).reshape(-1, 2),
        class_log=np.array([thing.class_log for thing in things]).reshape(-1, classes),
        existence=1 / (1 + np.exp(-odds)),
    )


def stacked(blocks: list[ObjectColumns]) -> ObjectColumns:
    """All things of several blocks."""
    names = [field.name for field in fields(ObjectColumns)]
    return ObjectColumns(**{n: np.concatenate([getattr(b, n) for b in blocks]) for n in names})
