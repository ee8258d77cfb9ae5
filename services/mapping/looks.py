"""What the scene classifier said about places, and from where it said it.

Looks from about the same stand are alike: the same light, the same mistake. They count as one, and
each place has one look for each stand it was seen from, the mean of all.
"""

from dataclasses import dataclass

import numpy as np

from schemas.arrays import Floats, Ints
from schemas.perception import SceneObservation

_least = 0.01
"""Even a sure classifier errs."""


@dataclass(frozen=True)
class LookColumns:
    """L looks: one for each place and stand."""

    place: Ints
    """(L,)"""
    stand: Ints
    """(L,)"""
    log_likelihood: Floats
    """(L, T) log P(i | a), up to a constant."""


class Looks:
    """Looks at places, which the caller numbers."""

    def __init__(self, types: int) -> None:
        self._types = types
        self._sums: dict[tuple[int, int], tuple[Floats, int]] = {}
        self._columns: LookColumns | None = None

    def add(self, place: int, stand: int, log_likelihood: Floats) -> None:
        """Enter one classifier output (T,)."""
        total, count = self._sums.get((place, stand), (np.zeros(self._types), 0))
        self._sums[place, stand] = (total + log_likelihood, count + 1)
        self._columns = None

    @property
    def columns(self) -> LookColumns:
        """All looks."""
        if self._columns is None:
            self._columns = self._stacked()
        return self._columns

    def _stacked(self) -> LookColumns:
        keys = np.array(list(self._sums), np.int32).reshape(-1, 2)
        means = [total / count for total, count in self._sums.values()]
        return LookColumns(keys[:, 0], keys[:, 1], np.array(means).reshape(-1, self._types))


def fused_by_stand(looks: LookColumns, owner: Ints) -> tuple[Floats, Ints]:
    """Looks at the same owner from the same stand become one: means (n, T), owners (n,).

    Args:
        looks: L of them.
        owner: (L,) what each look speaks of; -1 is left out.
    """
    kept = owner >= 0
    stands = np.int64(looks.stand.max(initial=0)) + 1
    keys = owner[kept].astype(np.int64) * stands + looks.stand[kept]
    unique, row, count = np.unique(keys, return_inverse=True, return_counts=True)
    sums = np.zeros((len(unique), looks.log_likelihood.shape[1]))
    np.add.at(sums, row, looks.log_likelihood[kept])
    return sums / count[:, None], (unique // stands).astype(np.int32)


def log_likelihoods(scene: SceneObservation, locations: tuple[str, ...]) -> Floats:
    """Log P(i | a) (N, T) of each point for the robot's types of places.

    A type that the classifier does not know looks to it like any other.
    """
    table = np.full((len(scene.points_base), len(locations)), 1 / max(len(scene.types), 1))
    for column, name in enumerate(scene.types):
        if name in locations:
            table[:, locations.index(name)] = scene.probabilities[:, column]
    return np.log(np.maximum(table, _least))
