"""A mixture of Gaussians over places in the frame of the viewer."""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from schemas.arrays import Floats


@dataclass(frozen=True)
class PlacePrior:
    """K components, whose axes are those of the viewer."""

    means: Floats
    """(K, 2) [m]"""
    spreads: Floats
    """(K, 2) standard deviations [m]."""
    shares: Floats
    """(K,) summing to one."""

    def places_at(self, points: Floats) -> Floats:
        """Places (n, 2) made of points (n, 3) of the unit cube."""
        component = np.searchsorted(np.cumsum(self.shares)[:-1], points[:, 2], side="right")
        return self.means[component] + self.spreads[component] * ndtri(points[:, :2])

    def log_components(self, places: Floats) -> Floats:
        """Log of share times density (n, K) at places (n, 2)."""
        scaled = (places[:, None] - self.means) / self.spreads
        log_normal = -0.5 * np.sum(scaled**2, axis=2)
        return log_normal + np.log(self.shares / (2 * np.pi * self.spreads.prod(axis=1)))

    def widened(self, share: float, spread: float) -> "PlacePrior":
        """Mixed with a `share` of places all about, of a `spread` [m]."""
        return PlacePrior(
            np.concatenate([self.means, np.zeros((1, 2))]),
            np.concatenate([self.spreads, np.full((1, 2), spread)]),
            np.append((1 - share) * self.shares, share),
        )

    def log_density(self, places: Floats) -> Floats:
        """Log density (n,) at places (n, 2)."""
        return np.logaddexp.reduce(self.log_components(places), axis=1)


by_hand = PlacePrior(
    means=np.array([[7.0, 0.0], [0.0, 0.0]]),
    spreads=np.array([[3.5, 5.0], [12.0, 12.0]]),
    shares=np.array([0.85, 0.15]),
)
"""Without data: ahead of the viewer, mostly."""
