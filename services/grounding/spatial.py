"""How true a spatial relation is between two objects, in the frame of the viewer.

Frame: origin at the landmark, u away from the viewer through the landmark, v to the left of u; for
the robot as landmark u points behind its back and v to its left.  The paper's relations are
Gaussians whose mean and spread depend on the objects' sizes.  Outdoors people say "behind" over a
wide range of distances and directions, so a side is here a soft sector times a log-normal distance.
Relations about ways ("down", "past") are Gaussians along the landmark's long axis, for which the
viewer's line of sight stands in where the landmark has none.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_TINY = 1e-300
"""Keeps a quotient of vanishing densities finite."""

GAP = 2.2
"""Typical free space between a landmark and what stands to one side of it [m]."""
NEAR_GAP = 1.5
"""The same for "near" [m]."""
ROBOT_GAP = 4.0
"""The same where the landmark is the robot: what it is told about is rarely that close [m]."""
WAY_GAP = 4.0
"""The same at the end of a way: "down", "through", "past" [m]."""
AWAY_GAP = 6.0
"""The same for "away from" and "far from" [m]."""
LOG_SPREAD = 0.8
"""Standard deviation of the logarithm of distances."""
NEAR_LOG_SPREAD = 0.5
"""The same for "near"."""
AWAY_LOG_SPREAD = 0.35
"""The same for "away" on the side of the landmark, where it soon stops being true."""
HALF_SECTOR = {"back": 60.0, "front": 60.0, "left": 30.0, "right": 30.0}
"""Half the sector of each side [deg]; the four share the circle.  What is seen beyond or before a
thing is named so more readily than what is seen beside it."""
SECTOR_EDGE = math.radians(5.0)
"""Width of the blurred edge between two sectors [rad]."""
TOWARDS_SPREAD = math.radians(20.0)
"""Standard deviation of the direction of "towards", seen from the viewer [rad]."""
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
    of_robot: bool
    """Whether the landmarks are the robot itself."""
    sight: Floats
    """Distance from the viewer to the landmark [m] (P,)."""
    axis_along: Floats
    """Along the landmark's long axis, away from the viewer [m] (P,)."""
    axis_across: Floats
    """Across the landmark's long axis [m] (P,)."""
    margin: Floats
    """How far the figure's centre is within the landmark's box, negative outside [m] (P,)."""
    area: Floats
    """Ground area of the landmark's box [m^2] (P,)."""

    @cached_property
    def distance(self) -> Floats:
        """Between the centres [m] (P,)."""
        return np.hypot(self.along, self.across)

    def reach(self, gap: float) -> Floats:
        """Typical distance between the centres for a typical free space [m] (P,)."""
        return self.touch + (ROBOT_GAP if self.of_robot else gap)


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
    densities = {DENSITY[name]: DENSITY[name](placement) for name in family}
    for density in densities.values():
        total += density
    return densities[DENSITY[relation]] / total


def is_unbounded(relation: str) -> bool:
    """Whether almost any two objects stand in this relation, so that it says little."""
    return relation in _UNBOUNDED


def typical_offset(relation: str, of_robot: bool) -> Floats:
    """(x, y) of a figure at the most typical place, from a landmark ahead along +x [m] (2,).

    If the landmark is the robot itself, +x is its heading.
    """
    u, v, gap = _TYPICAL.get(relation, (0.0, 1.0, NEAR_GAP))
    scale = 0.5 + (ROBOT_GAP if of_robot else gap)
    return np.array([-u * scale if of_robot else u * scale, v * scale])


def _log_normal(distance: Floats, median: Floats, spread: Floats | float) -> Floats:
    safe = np.maximum(distance, 1e-3)
    z = np.log(safe / median) / spread
    density = np.exp(-0.5 * z * z) / (safe * spread * math.sqrt(2.0 * math.pi))
    return np.where(distance > 0.0, density, 0.0)


def _normal(value: Floats, mean: Floats | float, spread: Floats | float) -> Floats:
    z = (value - mean) / spread
    return np.exp(-0.5 * z * z) / (spread * math.sqrt(2.0 * math.pi))


def _side(forward: Floats, sideways: Floats, half_sector: float, p: Placement) -> Floats:
    off = np.abs(np.arctan2(sideways, forward))
    inside = 0.5 * (1.0 + np.tanh(0.5 * (math.radians(half_sector) - off) / SECTOR_EDGE))
    # Shared, not one for each sector: where two sectors meet, both sides are as likely to be said.
    width = math.radians(sum(HALF_SECTOR.values()) / 2.0)
    radial = _log_normal(p.distance, p.reach(GAP), LOG_SPREAD)
    return radial * inside / (width * np.maximum(p.distance, 1e-3))


def _back(p: Placement) -> Floats:
    return _side(p.along, p.across, HALF_SECTOR["back"], p)


def _front(p: Placement) -> Floats:
    return _side(-p.along, p.across, HALF_SECTOR["front"], p)


def _left(p: Placement) -> Floats:
    return _side(p.across, p.along, HALF_SECTOR["left"], p)


def _right(p: Placement) -> Floats:
    return _side(-p.across, p.along, HALF_SECTOR["right"], p)


def _near(p: Placement) -> Floats:
    return _log_normal(p.distance, p.reach(NEAR_GAP), NEAR_LOG_SPREAD) / _ring(p)


def _away(p: Placement) -> Floats:
    median = p.touch + AWAY_GAP + (ROBOT_GAP if p.of_robot else 0.0)
    spread = np.where(p.distance < median, AWAY_LOG_SPREAD, LOG_SPREAD)
    return _log_normal(p.distance, median, spread) / _ring(p)


def _ring(p: Placement) -> Floats:
    return 2.0 * math.pi * np.maximum(p.distance, 1e-3)


def _inside(p: Placement) -> Floats:
    edge = 0.1 + 0.05 * np.sqrt(p.area)
    return 0.5 * (1.0 + np.tanh(0.5 * p.margin / edge)) / np.maximum(p.area, 1e-2)


def _down(p: Placement) -> Floats:
    along = _normal(p.axis_along, p.reach(WAY_GAP), 2.0 + 0.35 * p.touch)
    return along * _normal(p.axis_across, 0.0, 1.2 + 0.35 * p.touch)


def _past(p: Placement) -> Floats:
    along = _normal(p.along, p.reach(WAY_GAP), 2.0 + 0.5 * p.touch)
    return along * _normal(p.across, 0.0, 1.5 + 0.5 * p.touch)


def _towards(p: Placement) -> Floats:
    ahead = p.along + p.sight
    seen_at = np.hypot(ahead, p.across)
    direction = _normal(np.arctan2(p.across, ahead), 0.0, TOWARDS_SPREAD)
    radial = _log_normal(seen_at, p.sight + p.touch + 0.5, LOG_SPREAD)
    return direction * radial / np.maximum(seen_at, 1e-3)


def _around(p: Placement) -> Floats:
    """Beyond the landmark and to either side of it, as round a corner."""
    reach = p.reach(GAP)
    along = _normal(p.along, 0.5 * reach, 0.5 + 0.5 * reach)
    return along * _normal(np.abs(p.across), reach, 0.5 + 0.35 * p.touch) / 2.0


DENSITY: dict[str, Callable[[Placement], Floats]] = {
    "back": _back,
    "behind": _back,
    "front": _front,
    "left": _left,
    "right": _right,
    "near": _near,
    "away": _away,
    "inside": _inside,
    "down": _down,
    "through": _down,
    "past": _past,
    "towards": _towards,
    "around": _around,
}


FAMILIES = (
    ("back", "behind", "front", "left", "right"),
    ("near", "away"),
    ("inside",),
    ("down",),
    ("through",),
    ("past",),
    ("towards",),
    ("around",),
)
"""Relations of one family exclude one another; "behind" and "near" may both be true."""

_UNBOUNDED = ("away",)
"""Relations that hold for almost any two objects, wherever they stand."""

_TYPICAL = {
    "back": (1.0, 0.0, GAP),
    "behind": (1.0, 0.0, GAP),
    "front": (-1.0, 0.0, GAP),
    "left": (0.0, 1.0, GAP),
    "right": (0.0, -1.0, GAP),
    "inside": (0.0, 0.0, 0.0),
    "away": (0.0, 1.0, AWAY_GAP),
    "down": (1.0, 0.0, WAY_GAP),
    "through": (1.0, 0.0, WAY_GAP),
    "past": (1.0, 0.0, WAY_GAP),
    "towards": (0.0, 0.0, 0.0),
    "around": (0.6, 1.0, GAP),
}
