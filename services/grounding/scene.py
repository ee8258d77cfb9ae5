"""The seen things that an instruction may mean, and how to tell them apart in words."""

import math
from dataclasses import dataclass

BESIDE = 4.0
"""A thing this close to another can be named after it [m]."""
CLEARLY = 1.0
"""By so much nearer than all others of its kind [m]."""


@dataclass(frozen=True)
class Thing:
    """Something that was seen."""

    node: int
    """Id in the belief."""
    name: str
    x: float
    """Map frame [m]."""
    y: float
    mass: float
    """Probability that it is what is meant."""

    def distance(self, other: "Thing") -> float:
        """Between the centres [m]."""
        return math.hypot(self.x - other.x, self.y - other.y)


Scene = tuple[Thing, ...]


def told_apart(candidates: Scene, scene: Scene) -> tuple[str, ...] | None:
    """A phrase for each candidate that fits no other: "the hydrant near the cone".

    None if some candidate has nothing beside it that tells it apart.
    """
    landmarks = [one for one in scene if one.name != candidates[0].name]
    unique = [one for one in landmarks if sum(other.name == one.name for other in landmarks) == 1]
    phrases = [_phrase(one, candidates, unique) for one in candidates]
    found = [phrase for phrase in phrases if phrase]
    return tuple(found) if len(found) == len(candidates) else None


def _phrase(one: Thing, candidates: Scene, landmarks: list[Thing]) -> str | None:
    telling = [landmark for landmark in landmarks if _tells_apart(landmark, one, candidates)]
    nearest = min(telling, key=one.distance, default=None)
    return f"the {one.name} near the {nearest.name}" if nearest else None


def _tells_apart(landmark: Thing, one: Thing, candidates: Scene) -> bool:
    others = [landmark.distance(other) for other in candidates if other is not one]
    gap = landmark.distance(one)
    return gap <= BESIDE and all(other > gap + CLEARLY for other in others)
