"""How well stated probabilities match how often they are right."""

import numpy as np
from numpy.typing import NDArray

BINS = 10


def expected_calibration_error(
    confidence: NDArray[np.float64], correct: NDArray[np.bool_] | NDArray[np.float64]
) -> float:
    """Mean gap between confidence and accuracy over equal-width bins, weighted by their size.

    Args:
        confidence: stated probability of each answer, in [0, 1] (N,).
        correct: whether it was right, or the share of credit it gets (N,).
    """
    if not len(confidence):
        return 0.0
    bins = np.minimum((confidence * BINS).astype(np.int64), BINS - 1)
    gaps = np.bincount(bins, weights=confidence - correct, minlength=BINS)
    return float(np.abs(gaps).sum() / len(confidence))
