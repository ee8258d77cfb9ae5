"""Bisection of a spatial region by spectral clustering (Eq. segmentation_likelihood).

The normalised cut of Shi and Malik on the overlap of laser scans, as in Blanco et al. 2006.
"""

from dataclasses import dataclass

import numpy as np

from schemas.arrays import Flags, Floats

_alpha = 20.0
"""A room and a hallway are split in 9 of 10 particles, one room in 1 of 20."""


@dataclass(frozen=True)
class Cut:
    """The best division of n pose nodes in two."""

    first: Flags
    """(n,) Nodes of one of the two parts."""
    value: float
    """Normalised cut, in [0, 2]."""

    @property
    def probability(self) -> float:
        """Likelihood of dividing here."""
        return split_probability(self.value)


def split_probability(cut: float) -> float:
    """Eq. segmentation_likelihood: the weaker the tie, the likelier are two regions."""
    return 1 / (1 + _alpha * cut**3)


def bisect(similarity: Floats) -> Cut:
    """Best threshold on the second eigenvector of the normalised Laplacian of (n, n), n >= 2."""
    root = 1 / np.sqrt(similarity.sum(axis=1))
    affinity = root[:, None] * similarity * root
    _, vectors = np.linalg.eigh(affinity)
    # Ascending: the second smallest of the Laplacian I - A is the second largest of A.
    order = np.argsort(root * vectors[:, -2], kind="stable")
    values = _cuts_along(similarity[order][:, order])
    best = int(np.argmin(values))
    first = np.zeros(len(order), np.bool_)
    first[order[: best + 1]] = True
    return Cut(first, float(values[best]))


def normalised_cut(similarity: Floats, first: Flags) -> float:
    """Of the division of (n, n) into `first` (n,) and the rest."""
    across = similarity[first][:, ~first].sum()
    return float(across / similarity[first].sum() + across / similarity[~first].sum())


def _cuts_along(ordered: Floats) -> Floats:
    """Normalised cuts (n-1,) of all divisions into the first k and the rest."""
    degree = np.cumsum(ordered.sum(axis=1))
    within = np.cumsum(2 * np.tril(ordered, -1).sum(axis=1) + np.diag(ordered))
    across = (degree - within)[:-1]
    return across / degree[:-1] + across / (degree[-1] - degree[:-1])
