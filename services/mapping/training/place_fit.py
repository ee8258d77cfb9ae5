"""Where things that people speak of may be: a mixture of Gaussians in the viewer's frame, by EM.

Left and right are alike, so places are mirrored and the component that is fitted lies on the
robot's axis. The other one stays as it is, broad and about the robot: a person may speak of what
lies elsewhere than in the training worlds.
"""

import numpy as np

from schemas.arrays import Floats
from services.mapping.place_prior import PlacePrior

_rounds = 50
_broad_share, _broad_spread = 0.25, 10.0
_least_spread = 3.0
"""The component stays wider than what the training worlds have in common by choice [m]."""


def fit_places(places: Floats) -> PlacePrior:
    """Maximum likelihood of places (n, 2)."""
    both = np.concatenate([places, places * [1, -1]])
    means = np.array([[both[:, 0].mean(), 0.0], [0.0, 0.0]])
    spreads = np.array([both.std(axis=0), [_broad_spread] * 2])
    found = PlacePrior(means, spreads, np.array([1 - _broad_share, _broad_share]))
    for _ in range(_rounds):
        found = _better(found, both)
    return found


def _better(found: PlacePrior, places: Floats) -> PlacePrior:
    """One round of expectation and maximisation."""
    log_joint = found.log_components(places)
    owner = np.exp(log_joint - np.logaddexp.reduce(log_joint, axis=1)[:, None])[:, :-1]
    total = owner.sum(axis=0)
    means, spreads = found.means.copy(), found.spreads.copy()
    means[:-1, 0] = places[:, 0] @ owner / total
    off = (places[:, None] - means[:-1]) ** 2
    spreads[:-1] = np.sqrt(np.einsum("nk,nkd->kd", owner, off) / total[:, None])
    return PlacePrior(means, np.maximum(spreads, _least_spread), found.shares)
