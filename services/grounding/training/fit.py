"""Maximum a posteriori weights of a merged logistic regression by L-BFGS."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from services.grounding.training.rows import Problem

MAX_ITERATIONS = 300
TOLERANCE = 1e-7
"""Relative change of the objective below which it has converged."""


def fit(
    problem: Problem, seen: NDArray[np.bool_], penalty: float, start: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Values of the learned weights that maximise the log posterior.

    It is the sum over factors of log p(φ) less penalty / 2 * cost * |w|^2 of every weight.

    Args:
        problem: merged rows.
        seen: which examples to learn from (examples,).
        penalty: precision of the Gaussian prior on a weight of cost one.
        start: values to start from, such as those of a nearby penalty (columns,).
    """
    precision = penalty * problem.costs
    counts: NDArray[np.float64] = problem.counts[seen].sum(axis=0)
    kept = counts > 0.0
    design, signs, counts = problem.design[kept], problem.signs[kept], counts[kept]
    transposed = design.T.tocsr()

    def objective(values: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        margins: NDArray[np.float64] = signs * (design @ values)
        loss = float(counts @ np.logaddexp(0.0, -margins))
        wrong = counts * signs * np.exp(-np.logaddexp(0.0, margins))
        gradient: NDArray[np.float64] = precision * values - transposed @ wrong
        return loss + 0.5 * float(precision @ values**2), gradient

    found = minimize(
        objective,
        start,
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": MAX_ITERATIONS, "maxcor": 20, "ftol": TOLERANCE},
    )
    return np.asarray(found.x, dtype=np.float64)
