"""What a benchmark says: rows of the same shape as those of `incognita bench --json`."""

import re
from collections.abc import Sequence
from typing import Literal

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray
from scipy.stats import binom

Samples = NDArray[np.float64]
Better = Literal["lower", "higher"]


class Peer(Struct, frozen=True):
    """What ours is measured beside, in the same run."""

    name: str
    value: float


class Row(Struct, frozen=True, kw_only=True):
    """One figure with a direction."""

    row: str
    """What was measured."""
    metric: str
    unit: str
    better: Better
    ours: float
    interval: tuple[float, float]
    """95 % of `ours`."""
    peer: Peer | None = None
    drift: float | None = None
    """Factor by which the ratio to the peer may be worse than in the baseline."""
    limit: float | None = None
    """Worst value of `ours` on any machine, for figures that are no speeds."""

    @property
    def key(self) -> str:
        """Name in the baseline; versions are no part of it."""
        beside = f", beside {self.peer.name}" if self.peer else ""
        return re.sub(r" [0-9]+(\.[0-9]+)+", "", f"{self.row}, {self.metric}{beside}")

    @property
    def ratio(self) -> float | None:
        """Ours by the peer's."""
        return self.ours / self.peer.value if self.peer and self.peer.value else None

    def worsening(self, baseline_ratio: float) -> float:
        """Factor by which the ratio is worse than the baseline's; below 1 it is better."""
        assert self.ratio is not None, self.key
        grown = self.ratio / baseline_ratio
        return grown if self.better == "lower" else 1 / grown

    @property
    def within_limit(self) -> bool:
        """Whether `ours` is good enough by itself."""
        if self.limit is None:
            return True
        return self.ours <= self.limit if self.better == "lower" else self.ours >= self.limit


def quantile(samples: Samples | Sequence[float], q: float = 0.5) -> float:
    return float(np.quantile(samples, q))


def quantile_interval(samples: Samples | Sequence[float], q: float = 0.5) -> tuple[float, float]:
    """95 % interval of a quantile by order statistics, without assuming a distribution.

    With few samples the outermost ones stand for ranks beyond them.
    """
    ordered = np.sort(samples)
    low, high = binom.ppf([0.025, 0.975], len(ordered), q).astype(int)
    return float(ordered[max(low - 1, 0)]), float(ordered[min(high, len(ordered) - 1)])


def compared(
    row: str,
    metric: str,
    unit: str,
    ours: Samples,
    peer: tuple[str, Samples],
    *,
    drift: float,
    q: float = 0.5,
    better: Better = "lower",
) -> Row:
    """A row of the same quantile of our samples and the peer's."""
    name, theirs = peer
    return Row(
        row=row,
        metric=metric,
        unit=unit,
        better=better,
        ours=quantile(ours, q),
        interval=quantile_interval(ours, q),
        peer=Peer(name, quantile(theirs, q)),
        drift=drift,
    )
