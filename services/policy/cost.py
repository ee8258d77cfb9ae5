"""What every cost of candidates offers, be it learned or set by hand (Eq. policy)."""

from dataclasses import dataclass
from typing import Literal, Protocol

from schemas.arrays import Flags, Floats
from schemas.language import BehaviorSymbol

Words = Literal["none", "relation", "comparative", "any"]
"""What kind of landmark an instruction names: none, one in a relation, one that the figure is
nearest to; "any" where it is not known."""


@dataclass(frozen=True)
class Circumstances:
    """What costs may depend on beside the features."""

    searching_s: float
    """How long the search has taken [s]."""
    words: Words
    following: bool
    """Whether row 1 of the candidates is the one that is being followed."""
    settled: bool = False
    """Whether what is likeliest to be meant was the goal beyond doubt at the last decision."""


@dataclass(frozen=True)
class Judgement:
    """What is thought of C candidates."""

    costs: Floats
    """(C,) Finite; the cheapest is chosen."""
    gains: Floats
    """(C,) What each is worth, in [0, 1] about."""
    worthwhile: Flags
    """(C,) Whether it is worth doing at all."""


class Cost(Protocol):
    """c(x, a, p(S)) of Eq. policy."""

    @property
    def moments(self) -> int:
        """K, how many moments of the features it reads."""
        ...

    def gate(self, circumstances: Circumstances) -> float:
        """Probability from which on the seen thing that is likeliest to be meant is the goal."""
        ...

    def judge(self, features: Floats, circumstances: Circumstances) -> Judgement:
        """Judge candidates with features (C, K, D)."""
        ...


def words_of(behaviors: tuple[BehaviorSymbol, ...]) -> Words:
    """Of an instruction by its behaviours, the likeliest first."""
    if not behaviors:
        return "any"
    likeliest = behaviors[0]
    if likeliest.comparative:
        return "comparative"
    return "none" if likeliest.relation == "unknown" else "relation"
