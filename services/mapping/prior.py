"""What is believed about things before anything is seen: where they may be and how big they are."""

import numpy as np
from scipy.special import ndtri

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
_density_of_places = {
    "generic": 1 / 100,
    "office": 1 / 200,
    "hallway": 1 / 500,
    "lab": 1 / 1000,
    "conference room": 1 / 1000,
    "kitchen": 1 / 3000,
    "lounge": 1 / 3000,
    "elevator": 1 / 3000,
    "cafeteria": 1 / 5000,
}
"""The same for places: a floor has many offices and one kitchen."""
_default_radius = 0.2
_large_radius = {"building": 2.5, "wall": 0.3}
_radius_of_places = dict.fromkeys(_density_of_places, 2.0) | {"hallway": 3.0, "elevator": 1.0}

_means = np.array([[7.0, 0.0], [0.0, 0.0]])
_spreads = np.array([[3.5, 5.0], [12.0, 12.0]])
_shares = np.array([0.85, 0.15])


def density_of(name: str) -> float:
    """Unrelated things of a class per square metre [1/m^2]."""
    return _density_of_places.get(name, background_density)


def typical_radius(name: str) -> float:
    """Half width of a thing of this class that was not seen yet, or of the robot itself [m]."""
    radii = _typical_radius | _large_radius | _radius_of_places
    return radii.get(name, _default_radius)


def places_at(points: Floats, viewer: Pose2) -> Floats:
    """Places (n, 2), map frame, made of points (n, 3) of the unit cube.

    People speak of what lies ahead of the robot, mostly.
    """
    component = np.searchsorted(np.cumsum(_shares)[:-1], points[:, 2], side="right")
    return viewer.apply(_means[component] + _spreads[component] * ndtri(points[:, :2]))


def log_place(points: Floats, viewer: Pose2) -> Floats:
    """Log density (n,) of what `places_at` makes of even points, at points (n, 2), map frame."""
    local = viewer.inverse().apply(points)
    scaled = (local[:, None] - _means) / _spreads
    log_normal = -0.5 * np.sum(scaled**2, axis=2) - np.log(2 * np.pi * _spreads.prod(axis=1))
    return np.logaddexp.reduce(log_normal + np.log(_shares), axis=1)
