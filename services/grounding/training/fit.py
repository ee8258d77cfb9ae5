"""Maximum a posteriori weights of a merged logistic regression by L-BFGS."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from services.grounding.dcg import Weights
from services.grounding.training.rows import Problem

MAX_ITERATIONS = 300


def fit(problem: Problem, penalty: float) -> Weights:
    """Maximises sum over factors of log p(φ) - penalty / 2 * |w|^2.

    Args:
        problem: merged rows.
        penalty: precision of the Gaussian prior on every weight.
    """
    design, transposed = problem.design, problem.design.T.tocsr()

    def objective(values: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        margins: NDArray[np.float64] = problem.signs * (design @ values)
        loss = float(problem.counts @ np.logaddexp(0.0, -margins))
        wrong = problem.counts * problem.signs * np.exp(-np.logaddexp(0.0, margins))
        gradient: NDArray[np.float64] = penalty * values - transposed @ wrong
        return loss + 0.5 * penalty * float(values @ values), gradient

    found = minimize(
        objective,
        np.zeros(len(problem.columns)),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": MAX_ITERATIONS, "maxcor": 20},
    )
    return problem.weights(np.asarray(found.x, dtype=np.float64))
