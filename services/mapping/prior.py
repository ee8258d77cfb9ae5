"""What is believed about things before anything is seen: where they may be and how big they are."""

from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Literal

import msgspec
import numpy as np
from msgspec import Struct

from schemas.arrays import Floats
from schemas.geometry import Pose2
from services.mapping.place_prior import PlacePrior

Role = Literal["figure", "landmark"]
"""What people speak of, and what they name to say where it is, which is nearer to them."""
Meant = Role | Literal["figure room", "landmark room"]
"""The same for things and for rooms."""
as_room: Mapping[Role, Meant] = {"figure": "figure room", "landmark": "landmark room"}

_share_about, _about = 0.5, 10.0
"""Share of rooms that are anywhere about, and how far [m]: walls hide them, and who speaks of one
need not face it."""
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


class PlaceWeights(Struct, frozen=True, kw_only=True):
    """Of a mixture of places, see `PlacePrior`."""

    means: tuple[tuple[float, float], ...]
    spreads: tuple[tuple[float, float], ...]
    shares: tuple[float, ...]


class PriorWeights(Struct, frozen=True, kw_only=True):
    """What was learned in training worlds, and how good it is."""

    source: str
    first_seed: int
    worlds: int
    """Of each kind."""
    places: Mapping[Role, PlaceWeights]
    densities: dict[str, float]
    """Unrelated things by class [1/m^2]."""
    held_out: dict[str, float]
    """Mean log probabilities in worlds that were not fitted to, with and without learning."""


@cache
def learned() -> PriorWeights:
    """Weights as they are kept with the program."""
    file = resources.files("services.mapping") / "weights" / "priors.json"
    return msgspec.json.decode(file.read_bytes(), type=PriorWeights)


@cache
def place_prior(role: Meant) -> PlacePrior:
    """Where things of a role may be, or rooms."""
    if role not in ("figure", "landmark"):
        own = "figure" if role == as_room["figure"] else "landmark"
        return place_prior(own).widened(_share_about, _about)
    weights = learned().places[role]
    return PlacePrior(np.array(weights.means), np.array(weights.spreads), np.array(weights.shares))


def density_of(name: str) -> float:
    """Unrelated things of a class per square metre [1/m^2]."""
    known = _density_of_places | learned().densities
    return known.get(name, background_density)


def typical_radius(name: str) -> float:
    """Half width of a thing of this class that was not seen yet, or of the robot itself [m]."""
    radii = _typical_radius | _large_radius | _radius_of_places
    return radii.get(name, _default_radius)


def places_at(role: Meant, points: Floats, viewer: Pose2) -> Floats:
    """Places (n, 2), map frame, made of points (n, 3) of the unit cube."""
    return viewer.apply(place_prior(role).places_at(points))


def log_place(role: Meant, points: Floats, viewer: Pose2) -> Floats:
    """Log density (n,) of what `places_at` makes of even points, at points (n, 2), map frame."""
    return place_prior(role).log_density(viewer.inverse().apply(points))
