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

    One of them may have nothing beside it that tells it apart: it is "the other hydrant". None if
    several do.
    """
    landmarks = [one for one in scene if one.name != candidates[0].name]
    unique = [one for one in landmarks if sum(other.name == one.name for other in landmarks) == 1]
    phrases = [_phrase(one, candidates, unique) for one in candidates]
    if phrases.count(None) > 1:
        return None
    return tuple(phrase or f"the other {candidates[0].name}" for phrase in phrases)


def the_only(candidates: Scene) -> tuple[str, ...]:
    """Phrases where no word can tell things from others, which were not seen."""
    return tuple(f"the {one.name} that I see now" for one in candidates)


def _phrase(one: Thing, candidates: Scene, landmarks: list[Thing]) -> str | None:
    telling = [landmark for landmark in landmarks if _tells_apart(landmark, one, candidates)]
    nearest = min(telling, key=one.distance, default=None)
    return f"the {one.name} near the {nearest.name}" if nearest else None


def _tells_apart(landmark: Thing, one: Thing, candidates: Scene) -> bool:
    others = [landmark.distance(other) for other in candidates if other is not one]
    gap = landmark.distance(one)
    return gap <= BESIDE and all(other > gap + CLEARLY for other in others)
