"""Hypotheses about what an utterance refers to, as columns."""

from dataclasses import dataclass, fields, replace

import numpy as np

from schemas.arrays import Floats, Ints
from services.mapping.even import along_curve, copies, even_thresholds

nothing = -1
hypothesised_figure = 1000
hypothesised_landmark = 1001
"""Ids of things that nobody saw yet; seen objects have the ids of the run, below 1000."""
first_region = 2000
"""Ids of regions: this plus their oldest pose node."""
first_glimpse = 3000
"""Ids of places that were only looked into: this plus the spot that was recognised first."""


@dataclass(frozen=True)
class Particles:
    """P hypotheses. The observed map, which they share, is not repeated in them."""

    log_weight: Floats
    """(P,) of normalised weights."""
    reading: Ints
    """(P,) which reading of the utterance."""
    figure: Ints
    """(P,) id of what is meant, `hypothesised_figure` or `nothing`."""
    landmark: Ints
    """(P,) id of what is meant, `hypothesised_landmark` or `nothing`."""
    figure_position: Floats
    """(P, 2), map frame [m]."""
    landmark_position: Floats
    """(P, 2), map frame [m]."""
    topology: Ints
    """(P,) which of the topologies that the filter keeps."""
    log_total: float = 0.0
    """Of the weights before they were normalised: of a sample of a posterior the log evidence."""

    @property
    def weights(self) -> Floats:
        """(P,) summing to one."""
        return np.exp(self.log_weight)

    @property
    def effective(self) -> float:
        """1 / sum of squared weights (Section "Re-weighting particles and resampling")."""
        return float(1 / np.sum(self.weights**2))

    def __len__(self) -> int:
        return len(self.log_weight)

    def take(self, rows: Ints) -> "Particles":
        """Rows by index, with their weights as they are."""
        return replace(self, log_total=0.0, **{n: getattr(self, n)[rows] for n in _columns})

    def weighted(self, log_weight: Floats) -> "Particles":
        """The same hypotheses with new weights (P,), which are normalised.

        What is no number counts for nothing; where nothing counts, all count alike.
        """
        if not np.isfinite(log_weight).all():
            log_weight = np.where(np.isfinite(log_weight), log_weight, -np.inf)
            if not np.isfinite(log_weight).any():
                log_weight = np.zeros(len(log_weight))
        top = log_weight.max()
        shifted = log_weight - top
        rest = np.log(np.exp(shifted).sum())
        return replace(self, log_weight=shifted - rest, log_total=float(top + rest))

    def resampled(self, count: int, start: float) -> "Particles":
        """`count` hypotheses of equal weight, evenly spread (see `even.copies`).

        Args:
            count: of hypotheses.
            start: in [0, 1); the same one picks the same hypotheses, as far as weights allow.
        """
        order = self._order()
        groundings = np.stack([self.reading, self.figure, self.landmark], axis=1)[order]
        thresholds = even_thresholds(groundings, start)
        rows = np.repeat(order, copies(self.weights[order], thresholds, count))
        return self.take(rows).weighted(np.zeros(count))

    def _order(self) -> Ints:
        """Rows by what they ground the utterance to, then by neighbourhood."""
        middle = 0.5 * (self.figure_position + self.landmark_position)
        alone = (self.landmark == nothing)[:, None]
        place = along_curve(np.where(alone, self.figure_position, middle))
        ties = (self.topology, *self.landmark_position.T, *self.figure_position.T)
        return np.lexsort((*ties, place, self.landmark, self.figure, self.reading)).astype(np.int32)


def empty_particles(count: int) -> Particles:
    """Hypotheses before anything was said: nothing is meant, all alike."""
    none = np.full(count, nothing, np.int32)
    zeros, first = np.zeros((count, 2)), np.zeros(count, np.int32)
    return Particles(np.full(count, -np.log(count)), first, none, none, zeros, zeros, first)


def joined(blocks: list[Particles]) -> Particles:
    """All rows of several blocks; their weights are not normalised again."""
    columns = {n: np.concatenate([getattr(block, n) for block in blocks]) for n in _columns}
    return replace(blocks[0], log_total=0.0, **columns)


_columns = [field.name for field in fields(Particles) if field.name != "log_total"]
