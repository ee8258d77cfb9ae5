"""Edges between regions, sampled by distance (Eq. spatial_distance_proposal)."""

import numpy as np

from schemas.arrays import Floats

_gamma = 0.3
"""Distance bias of the paper [1/m^2]."""
_abscissae, _weights = np.polynomial.hermite_e.hermegauss(24)


def edge_probability(distance: Floats, deviation: Floats) -> Floats:
    """Expectation of 1 / (1 + gamma d^2) for d a folded Gaussian (n,) [m].

    The integrand is even in d, so that folding the Gaussian does not change its expectation.
    """
    d = distance[:, None] + deviation[:, None] * _abscissae
    return (1 / (1 + _gamma * d**2)) @ _weights / _weights.sum()
