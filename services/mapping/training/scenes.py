"""Scenes for the data set of spatial relations: things around a viewer, none of them a world's.

A viewer stands at the origin. Things stand in its sector of view, some of them beside another
one, as street furniture and household goods do; the scale of a scene, from a room to a yard, is
drawn log-uniformly. Most things are small, some bulky, some large; of the large ones half are
open, as rooms, halls and boxes are: things may lie in them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from schemas.arrays import Flags, Floats, Ints

things = 10
"""N, of every scene."""
classes = 4
_scale = (4.0, 25.0)
"""Radius of a scene [m]."""
_half_sector = np.radians(75.0)
_kinds = (0.6, 0.2, 0.2)
"""Shares of small, bulky and large things."""
_half_extents = np.array([[0.1, 0.4], [0.4, 1.2], [1.2, 5.0]])
"""Of each kind, drawn log-uniformly [m]."""
_small_scene = 8.0
"""Scenes below this scale [m] hold proportionally smaller things."""
_beside, _within = 0.4, 0.25
"""Shares of things that stand beside an earlier one, and of those, in it if it is open."""
_beside_gap = (1.5, 0.7)
"""Median of that gap [m], and standard deviation of its logarithm."""


@dataclass(frozen=True)
class Scenes:
    """S scenes of N things each, in the frame of the viewer."""

    position: Floats
    """(S, N, 2) [m]"""
    half: Floats
    """(S, N, 2) half boxes along and across the line of sight to the thing [m]."""
    kind: Ints
    """(S, N) 0 small, 1 bulky, 2 large."""
    label: Ints
    """(S, N) class, of `classes`."""
    is_open: Flags
    """(S, N) whether things may lie inside."""
    facing: Floats
    """(S, N) direction of a thing's own front against the line of sight, NaN for none [rad]."""

    @property
    def radius(self) -> Floats:
        """(S, N) mean half width [m]."""
        return self.half.mean(axis=2)


def sample_scenes(count: int, rng: Generator) -> Scenes:
    """Independent scenes."""
    scale = np.exp(rng.uniform(np.log(_scale[0]), np.log(_scale[1]), (count, 1)))
    kind = rng.choice(3, (count, things), p=_kinds).astype(np.int32)
    low, high = np.log(_half_extents[kind]).transpose(2, 0, 1)
    half = np.exp(low[..., None] + (high - low)[..., None] * rng.random((count, things, 2)))
    half *= np.minimum(scale / _small_scene, 1.0)[..., None]
    is_open = (kind == 2) & (rng.random(kind.shape) < 0.5)
    has_front = (kind > 0) & (rng.random(kind.shape) < 0.5)
    facing = np.where(has_front, rng.uniform(-np.pi, np.pi, kind.shape), np.nan)
    position = _positions(scale, half, is_open, rng)
    label = rng.integers(0, classes, kind.shape).astype(np.int32)
    return Scenes(position, half, kind, label, is_open, facing)


def _positions(scale: Floats, half: Floats, is_open: Flags, rng: Generator) -> Floats:
    """Scattered over the sector (S, N, 2), some beside or in the thing before them."""
    shape = half.shape[:2]
    bearing = rng.uniform(-_half_sector, _half_sector, shape)
    distance = np.maximum(scale * np.sqrt(rng.random(shape)), 1.0)
    position = distance[..., None] * _direction(bearing)
    beside = rng.random(shape) < _beside
    within = rng.random(shape) < _within
    median, spread = _beside_gap
    gap = median * np.exp(spread * rng.standard_normal(shape)) * np.minimum(scale / _small_scene, 1)
    angle = rng.uniform(-np.pi, np.pi, shape)
    inside = rng.uniform(-0.9, 0.9, (*shape, 2))
    for i in range(1, things):
        size = half[:, i - 1].mean(axis=1) + half[:, i].mean(axis=1)
        around = (size + gap[:, i])[:, None] * _direction(angle[:, i])
        lies_in = within[:, i] & is_open[:, i - 1]
        offset = np.where(lies_in[:, None], inside[:, i] * half[:, i - 1], around)
        near = position[:, i - 1] + offset
        position[:, i] = np.where(beside[:, i][:, None], near, position[:, i])
    return position


def _direction(angle: Floats) -> Floats:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)
