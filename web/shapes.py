"""Meshes and line figures, made of nothing but numbers."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Floats, Floats32


class Mesh(NamedTuple):
    """Triangles, counter-clockwise from outside."""

    vertices: Floats32
    """(V, 3)"""
    faces: NDArray[np.uint32]
    """(F, 3)"""

    def scaled(self, *extent: float) -> "Mesh":
        """The mesh stretched along its axes."""
        return Mesh(self.vertices * np.array(extent, np.float32), self.faces)


@dataclass(frozen=True)
class Instances:
    """Copies of one mesh, a row each."""

    positions: Floats
    """Centres (N, 3), map frame [m]."""
    extents: Floats
    """Stretch of the mesh (N, 3); of a unit mesh its size [m]."""
    opacities: Floats
    """(N,) in [0, 1]"""

    @classmethod
    def on_floor(cls, positions: Floats, height: float) -> "Instances":
        """Unstretched opaque copies at points (N, 2)."""
        n = len(positions)
        centers = np.column_stack([positions, np.full(n, height)])
        return cls(centers, np.ones((n, 3)), np.ones(n))

    def padded(self) -> "Instances":
        """The copies and enough of no size to make their number a power of two.

        In the browser another number of copies means another object.
        """
        extra = (1 << max(len(self.positions) - 1, 0).bit_length()) - len(self.positions)
        columns = (self.positions, self.extents, self.opacities)
        return Instances(*(_with_zeros(column, extra) for column in columns))

    def on_levels(self, levels: Floats) -> "Instances":
        """The copies at the closest of a few fixed opacities, in a buffer that never changes them.

        Row `k * n + i` stands for copy i, out of n with padding, at opacity `levels[k]`; it has no
        size unless that is its level. viser builds a new object when opacities change, which
        blinks; places and sizes may change, and places do so less often than weights.
        """
        copies = self.padded()
        size = len(copies.positions)
        level = np.abs(copies.opacities[:, None] - levels).argmin(axis=1)
        rows = level * size + np.arange(size)
        extents = np.zeros((len(levels) * size, 3))
        extents[rows] = copies.extents
        positions = np.tile(copies.positions, (len(levels), 1))
        return Instances(positions, extents, np.repeat(levels, size))


def unit_prism(sides: int, top: float = 1.0, turn: float = 0.0) -> Mesh:
    """Upright prism or cone with unit width and height, centred at the origin.

    Args:
        sides: Corners of the floor plan.
        top: Width of the upper end; 0 makes a cone.
        turn: Rotation of the floor plan about the upright axis [rad].
    """
    angles = turn + 2 * np.pi * np.arange(sides) / sides
    ring = 0.5 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    lower, upper = np.full((sides, 1), -0.5), np.full((sides, 1), 0.5)
    caps = np.array([[0, 0, -0.5], [0, 0, 0.5]])
    vertices = np.vstack([np.hstack([ring, lower]), np.hstack([top * ring, upper]), caps])
    a = np.arange(sides)
    b = (a + 1) % sides
    walls = [np.stack([a, b, b + sides], -1), np.stack([a, b + sides, a + sides], -1)]
    floor = np.stack([b, a, np.full(sides, 2 * sides)], -1)
    ceiling = np.stack([a + sides, b + sides, np.full(sides, 2 * sides + 1)], -1)
    faces = np.vstack([*walls, floor, ceiling])
    return Mesh(vertices.astype(np.float32), faces.astype(np.uint32))


_box = unit_prism(4, turn=np.pi / 4)
UNIT_BOX = Mesh(_box.vertices * np.array([np.sqrt(2), np.sqrt(2), 1], np.float32), _box.faces)
"""Edges of length one along the axes."""
UNIT_CYLINDER = unit_prism(16)
UNIT_CONE = unit_prism(16, top=0.12)
ARROW = unit_prism(3, turn=0.0)
"""A flat triangle that points along +x once it is squeezed along z."""

_class_meshes = {
    "cone": UNIT_CONE,
    "hydrant": UNIT_CYLINDER,
    "barrel": UNIT_CYLINDER,
    "tree": UNIT_CYLINDER,
}

_corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_edges = [
    (i, j) for i in range(8) for j in range(i) if np.abs(_corners[i] - _corners[j]).sum() == 1
]


def class_mesh(name: str) -> Mesh:
    """Unit mesh that stands for an object class; a box unless something says more."""
    return _class_meshes.get(name, UNIT_BOX)


def wire_box(center: Floats, extent: Floats) -> Floats32:
    """The 12 edges (12, 2, 3) of an upright box."""
    corners = center + _corners * extent
    return corners[np.array(_edges)].astype(np.float32)


def _with_zeros(column: Floats, extra: int) -> Floats:
    return np.concatenate([column, np.zeros((extra, *column.shape[1:]))])


def polyline(points: Floats, height: float) -> Floats32:
    """Segments (N - 1, 2, 3) that join points (N, 2) at one height."""
    lifted = np.column_stack([points, np.full(len(points), height)])
    return np.stack([lifted[:-1], lifted[1:]], axis=1).astype(np.float32)


def ellipse(mean: Floats, covariance: Floats, sigmas: float, height: float) -> Floats32:
    """Outline (48, 2, 3) of the points at so many standard deviations from the mean."""
    variances, axes = np.linalg.eigh(covariance)
    angles = np.linspace(0, 2 * np.pi, 49)
    circle = np.stack([np.cos(angles), np.sin(angles)])
    points = mean + ((axes * (sigmas * np.sqrt(np.maximum(variances, 0)))) @ circle).T
    return polyline(points, height)
