"""How true a spatial relation is between two objects, in the frame of the viewer.

Frame: origin at the landmark, u away from the viewer through the landmark, v to the left of u; for
the robot as landmark u is its heading.  The paper's relations are Gaussians whose mean and spread
depend on the objects' sizes.  Outdoors people say "behind" over a wide range of distances, so the
distance along the relation's axis is log-normal here and only the offset across it Gaussian, with a
spread that grows with the distance, as people judge direction by angle.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_TINY = 1e-300
"""Keeps a quotient of vanishing densities finite."""

GAP = 1.25
"""Typical free space between two related objects outdoors [m]."""
ROBOT_GAP = 4.0
"""The same where the landmark is the robot: what it is told about is rarely that close [m]."""
AWAY_DISTANCE = 9.0
"""Typical distance of "away from" and "far from" [m]."""
LOG_SPREAD = 0.6
"""Standard deviation of the logarithm of distances."""
AWAY_LOG_SPREAD = 0.35
"""The same for "away" on the side of the landmark, where it soon stops being true."""
BACKGROUND_AREA = 400.0
"""An object that stands in no relation is anywhere in this area [m^2]."""


@dataclass(frozen=True)
class Placement:
    """Figures against landmarks, P pairs."""

    along: Floats
    """u of the figure [m] (P,)."""
    across: Floats
    """v of the figure [m] (P,)."""
    touch: Floats
    """Distance at which the two would touch: sum of their mean half edges [m] (P,)."""
    gap: Floats
    """Typical free space between them [m] (P,)."""
    room: Floats
    """Mean half edge of the landmark less that of the figure [m] (P,)."""

    @property
    def distance(self) -> Floats:
        """Between the centres [m] (P,)."""
        return np.hypot(self.along, self.across)


def viewer_frame(offsets: Floats, sight: Floats) -> tuple[Floats, Floats]:
    """Turns world offsets into (u, v).

    Args:
        offsets: figure less landmark in the world frame [m] (P, 2).
        sight: direction of u in the world frame, any length above zero (P, 2).
    """
    u = sight / np.maximum(np.hypot(sight[:, 0], sight[:, 1]), 1e-9)[:, None]
    along = offsets[:, 0] * u[:, 0] + offsets[:, 1] * u[:, 1]
    across = offsets[:, 1] * u[:, 0] - offsets[:, 0] * u[:, 1]
    return along, across


def truth(relation: str, placement: Placement) -> Floats:
    """Degree in [0, 1] to which each figure stands in a relation to its landmark (P,).

    It is the posterior of the relation against those that exclude it and, unless it is unbounded,
    against standing anywhere. A relation without geometry ("unknown") is always true.
    """
    family = next((names for names in FAMILIES if relation in names), ())
    if not family:
        return np.ones_like(placement.along)
    total = np.full_like(placement.along, _TINY if is_unbounded(relation) else 1 / BACKGROUND_AREA)
    for density in {DENSITY[name] for name in family}:
        total += density(placement)
    return DENSITY[relation](placement) / total


def is_unbounded(relation: str) -> bool:
    """Whether almost any two objects stand in this relation, so that it says little."""
    return relation in _UNBOUNDED


def typical_offset(relation: str, of_robot: bool) -> Floats:
    """(u, v) of a figure at the most typical place, for small objects [m] (2,)."""
    reach = ROBOT_GAP if of_robot else GAP + 0.5
    u, v = _TYPICAL.get(relation, (0.0, 1.0))
    scale = AWAY_DISTANCE if relation == "away" else reach
    return np.array([u * scale, v * scale])


def _log_normal(distance: Floats, median: Floats, spread: float = LOG_SPREAD) -> Floats:
    safe = np.maximum(distance, 1e-3)
    z = np.log(safe / median) / spread
    density = np.exp(-0.5 * z * z) / (safe * spread * math.sqrt(2.0 * math.pi))
    return np.where(distance > 0.0, density, 0.0)


def _directed(forward: Floats, sideways: Floats, placement: Placement) -> Floats:
    spread = 0.25 + 0.35 * placement.touch + 0.25 * np.maximum(forward, 0.0)
    z = sideways / spread
    across = np.exp(-0.5 * z * z) / (spread * math.sqrt(2.0 * math.pi))
    return _log_normal(forward, placement.touch + placement.gap) * across


def _back(p: Placement) -> Floats:
    return _directed(p.along, p.across, p)


def _front(p: Placement) -> Floats:
    return _directed(-p.along, p.across, p)


def _left(p: Placement) -> Floats:
    return _directed(p.across, p.along, p)


def _right(p: Placement) -> Floats:
    return _directed(-p.across, p.along, p)


def _near(p: Placement) -> Floats:
    return _log_normal(p.distance, p.touch + p.gap) / _ring(p)


def _away(p: Placement) -> Floats:
    median = np.maximum(3.0 * p.touch, AWAY_DISTANCE)
    closer = _log_normal(p.distance, median, AWAY_LOG_SPREAD)
    return np.where(p.distance < median, closer, _log_normal(p.distance, median)) / _ring(p)


def _ring(p: Placement) -> Floats:
    return 2.0 * math.pi * np.maximum(p.distance, 1e-3)


def _inside(p: Placement) -> Floats:
    spread = np.maximum(0.35 * p.room, 0.05)
    return np.exp(-0.5 * (p.distance / spread) ** 2) / (2.0 * math.pi * spread**2)


DENSITY: dict[str, Callable[[Placement], Floats]] = {
    "back": _back,
    "behind": _back,
    "front": _front,
    "left": _left,
    "right": _right,
    "near": _near,
    "away": _away,
    "inside": _inside,
}


FAMILIES = (("back", "behind", "front", "left", "right"), ("near", "away"), ("inside",))
"""Relations of one family exclude one another; "behind" and "near" may both be true."""

_UNBOUNDED = ("away",)
"""Relations that hold for almost any two objects, wherever they stand."""

_TYPICAL = {
    "back": (1.0, 0.0),
    "behind": (1.0, 0.0),
    "front": (-1.0, 0.0),
    "left": (0.0, 1.0),
    "right": (0.0, -1.0),
    "inside": (0.0, 0.0),
    "away": (0.0, 1.0),
}
