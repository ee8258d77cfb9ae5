"""The four sets of pictures, and what each may draw from.

No look, scene or light of one set is in another: looks differ by their remainder modulo four, and
everything else follows from seeds that begin with the number of the set.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from numpy.random import Generator

from schemas.errors import UserError
from sim.assets.asset import Asset
from sim.assets.library import make_asset

Choice = TypeVar("Choice")
_look_classes = 4


class UnknownPartError(UserError):
    """There is no such set of pictures; the message lists those there are."""


@dataclass(frozen=True)
class Part:
    """One set of pictures."""

    name: str
    stream: int
    """First number of the seed of each of its scenes."""
    look_remainders: tuple[int, ...]
    """Of its looks modulo four."""
    holds_objects: bool = True
    """Whether objects of the detector's classes are in its scenes, or distractors alone."""


PARTS = {
    part.name: part
    for part in (
        Part("train", 0, (0, 2)),
        Part("val", 1, (1,)),
        Part("test", 2, (3,)),
        Part("empty", 3, (3,), holds_objects=False),
    )
}
"""`train` to learn from, `val` to choose and calibrate with, `test` and `empty` to judge by."""


def get_part(name: str) -> Part:
    """Look up a set of pictures.

    Raises:
        UnknownPartError: there is none of that name.
    """
    if name not in PARTS:
        raise UnknownPartError(f"no set of pictures {name!r}; there are: {', '.join(PARTS)}")
    return PARTS[name]


@dataclass(frozen=True)
class Draw:
    """Chance, restricted to what a set of pictures may draw from."""

    part: Part
    rng: Generator

    def look(self) -> int:
        """A look of the set's own pool."""
        remainder = self.one(self.part.look_remainders)
        return _look_classes * int(self.rng.integers(2**29)) + remainder

    def asset(self, label: str) -> Asset:
        """An object of a class in some look."""
        return make_asset(label, self.look())

    def one(self, choices: Sequence[Choice]) -> Choice:
        """One of the choices, all alike likely."""
        return choices[int(self.rng.integers(len(choices)))]

    def sized(self, low: int, high: int) -> range:
        """A random number, low to high, of turns of a loop."""
        return range(int(self.rng.integers(low, high + 1)))
