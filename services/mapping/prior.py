"""What is believed about things before anything is seen: where they may be and how big they are."""

import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2

background_density = 1 / 500
"""Unrelated objects of a class per square metre: the concentration of the Dirichlet process
that decides between a known thing and a new one [1/m^2]."""
_typical_radius = {
    "cone": 0.2,
    "hydrant": 0.2,
    "barrel": 0.3,
    "tree": 0.4,
    "car": 0.9,
    "robot": 0.5,
}
_default_radius = 0.2
_large_radius = {"building": 2.5, "wall": 0.3}

_means = np.array([[7.0, 0.0], [0.0, 0.0]])
_spreads = np.array([[3.5, 5.0], [12.0, 12.0]])
_shares = np.array([0.85, 0.15])


def typical_radius(name: str) -> float:
    """Half width of a thing of this class that was not seen yet, or of the robot itself [m]."""
    return (_typical_radius | _large_radius).get(name, _default_radius)


def sample_places(rng: np.random.Generator, viewer: Pose2, count: int) -> Floats:
    """Places (n, 2), map frame: people speak of what lies ahead of the robot, mostly."""
    component = (rng.random(count) >= _shares[0]).astype(np.int32)
    return viewer.apply(_means[component] + _spreads[component] * rng.standard_normal((count, 2)))


def log_place(points: Floats, viewer: Pose2) -> Floats:
    """Log density (n,) of `sample_places` at points (n, 2), map frame."""
    local = viewer.inverse().apply(points)
    scaled = (local[:, None] - _means) / _spreads
    log_normal = -0.5 * np.sum(scaled**2, axis=2) - np.log(2 * np.pi * _spreads.prod(axis=1))
    return np.logaddexp.reduce(log_normal + np.log(_shares), axis=1)
