"""Where things that people speak of may be: a mixture of Gaussians in the viewer's frame, by EM.

Left and right are alike, so every place counts a second time mirrored. One component is not fitted:
broad and about the robot, because a person may speak of what lies elsewhere than in the training
worlds.
"""

import numpy as np

from schemas.arrays import Floats
from services.mapping.place_prior import PlacePrior

_rounds = 100
_fitted = 5
_first_bearings = np.radians(40.0)
"""The components start side by side, to either side of the robot's axis [rad]."""
_broad_share, _broad_spread = 0.03, 10.0
_least_spread = 1.5
"""Components stay wider than what the training worlds have in common by choice [m]."""


def fit_places(places: Floats) -> PlacePrior:
    """Maximum likelihood of places (n, 2)."""
    both = np.concatenate([places, places * [1, -1]])
    bearing = np.linspace(-_first_bearings, _first_bearings, _fitted)
    distance = np.linalg.norm(both, axis=1).mean()
    first = distance * np.column_stack([np.cos(bearing), np.sin(bearing)])
    found = PlacePrior(
        means=np.concatenate([first, np.zeros((1, 2))]),
        spreads=np.concatenate([np.full((_fitted, 2), both.std()), [[_broad_spread] * 2]]),
        shares=np.append(np.full(_fitted, (1 - _broad_share) / _fitted), _broad_share),
    )
    for _ in range(_rounds):
        found = _better(found, both)
    return found


def _better(found: PlacePrior, places: Floats) -> PlacePrior:
    """One round of expectation and maximisation."""
    log_joint = found.log_components(places)
    owner = np.exp(log_joint - np.logaddexp.reduce(log_joint, axis=1)[:, None])[:, :-1]
    total = owner.sum(axis=0)
    means, spreads, shares = found.means.copy(), found.spreads.copy(), found.shares.copy()
    means[:-1] = owner.T @ places / total[:, None]
    off = (places[:, None] - means[:-1]) ** 2
    spreads[:-1] = np.sqrt(np.einsum("nk,nkd->kd", owner, off) / total[:, None])
    shares[:-1] = (1 - _broad_share) * total / total.sum()
    return PlacePrior(means, np.maximum(spreads, _least_spread), shares)
