"""Hypotheses about what an utterance refers to, as columns."""

from dataclasses import dataclass, replace

import numpy as np

from schemas.arrays import Floats, Ints

nothing = -1
hypothesised_figure = 1000
hypothesised_landmark = 1001
"""Ids of things that nobody saw yet; seen things have the ids of the run, below 1000."""


@dataclass(frozen=True)
class Particles:
    """P hypotheses. The observed map, which they share, is not repeated in them."""

    log_weight: Floats
    """(P,) of normalised weights."""
    reading: Ints
    """(P,) which reading of the utterance."""
    figure: Ints
    """(P,) object id, `hypothesised_figure` or `nothing`."""
    landmark: Ints
    """(P,) object id, `hypothesised_landmark` or `nothing`."""
    figure_position: Floats
    """(P, 2), map frame [m]."""
    landmark_position: Floats
    """(P, 2), map frame [m]."""

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
        return Particles(
            log_weight=self.log_weight[rows],
            reading=self.reading[rows],
            figure=self.figure[rows],
            landmark=self.landmark[rows],
            figure_position=self.figure_position[rows],
            landmark_position=self.landmark_position[rows],
        )

    def weighted(self, log_weight: Floats) -> "Particles":
        """The same hypotheses with new weights (P,), which are normalised.

        What is no number counts for nothing; where nothing counts, all count alike.
        """
        if not np.isfinite(log_weight).all():
            log_weight = np.where(np.isfinite(log_weight), log_weight, -np.inf)
            if not np.isfinite(log_weight).any():
                log_weight = np.zeros(len(log_weight))
        top = log_weight.max()
        return replace(self, log_weight=log_weight - top - np.log(np.exp(log_weight - top).sum()))

    def resampled(self, count: int, rng: np.random.Generator) -> "Particles":
        """Systematic resampling: `count` hypotheses of equal weight."""
        edges = np.cumsum(self.weights)
        picks = (np.arange(count) + rng.random()) / count * edges[-1]
        rows = np.minimum(np.searchsorted(edges, picks), len(self) - 1).astype(np.int32)
        return self.take(rows).weighted(np.zeros(count))


def empty_particles(count: int) -> Particles:
    """Hypotheses before anything was said: nothing is meant, all alike."""
    none = np.full(count, nothing, np.int32)
    zeros = np.zeros((count, 2))
    reading = np.zeros(count, np.int32)
    return Particles(np.full(count, -np.log(count)), reading, none, none, zeros, zeros)


def joined(blocks: list[Particles]) -> Particles:
    """All rows of several blocks; their weights are not normalised again."""
    return Particles(
        log_weight=np.concatenate([block.log_weight for block in blocks]),
        reading=np.concatenate([block.reading for block in blocks]),
        figure=np.concatenate([block.figure for block in blocks]),
        landmark=np.concatenate([block.landmark for block in blocks]),
        figure_position=np.concatenate([block.figure_position for block in blocks]),
        landmark_position=np.concatenate([block.landmark_position for block in blocks]),
    )
