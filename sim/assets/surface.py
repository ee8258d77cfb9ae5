"""Triangle surfaces built from profiles: loft, lathe, box, cylinder, ball.

Every builder returns a `Surface` in metres, z up, with outward winding and texture coordinates
whose v axis grows downwards in the texture image.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Surface:
    """Vertices (n, 3) [m], triangles (m, 3) of vertex indices, texture coordinates (n, 2)."""

    vertices: Floats
    triangles: Ints
    uvs: Floats

    def at(
        self, position: ArrayLike = (0, 0, 0), rpy: tuple[float, float, float] = (0, 0, 0)
    ) -> Surface:
        """The same surface rotated by roll, pitch, yaw [rad] and then moved by `position` [m]."""
        moved = self.vertices @ rotation(*rpy).T + np.asarray(position, float)
        return Surface(moved, self.triangles, self.uvs)

    def scaled(self, factors: ArrayLike) -> Surface:
        """The same surface stretched along x, y, z by positive factors."""
        return Surface(self.vertices * np.asarray(factors, float), self.triangles, self.uvs)

    def tiled(self, u: float, v: float) -> Surface:
        """The same surface with its texture repeated u by v times."""
        return Surface(self.vertices, self.triangles, self.uvs * np.array([u, v]))


def rotation(roll: float, pitch: float, yaw: float) -> Floats:
    """Rotation matrix (3, 3) of roll about x, then pitch about y, then yaw about z [rad]."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a), math.sin(a)) for a in (roll, pitch, yaw))
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def join(surfaces: Sequence[Surface]) -> Surface:
    """One surface made of several."""
    starts = np.cumsum([0, *(len(s.vertices) for s in surfaces[:-1])])
    return Surface(
        np.concatenate([s.vertices for s in surfaces]),
        np.concatenate([s.triangles + start for s, start in zip(surfaces, starts, strict=True)]),
        np.concatenate([s.uvs for s in surfaces]),
    )


def loft(rings: ArrayLike, capped: bool = True) -> Surface:
    """Skin over k closed rings of n points each, (k, n, 3), counter-clockwise seen from the end.

    u runs around a ring, v from the last ring (0) to the first (1) by mean distance.
    """
    points = np.asarray(rings, float)
    count, around = points.shape[:2]
    closed = np.concatenate([points, points[:, :1]], axis=1)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=2).mean(axis=1)
    along = np.r_[0.0, np.cumsum(steps)]
    v = 1.0 - along / max(float(along[-1]), 1e-9)
    u = np.linspace(0.0, 1.0, around + 1)
    uvs = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    side = Surface(closed.reshape(-1, 3), _grid_triangles(count, around + 1), uvs)
    if not capped:
        return side
    return join([side, _cap(points[-1], 0.0), _cap(points[0][::-1], 1.0)])


def _grid_triangles(rows: int, columns: int) -> Ints:
    start = np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)[None, :]
    a, b = start.ravel(), start.ravel() + 1
    c, d = b + columns, a + columns
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def _cap(ring: Floats, v: float) -> Surface:
    count = len(ring)
    vertices = np.concatenate([ring, ring.mean(axis=0, keepdims=True)])
    index = np.arange(count)
    triangles = np.stack([index, (index + 1) % count, np.full(count, count)], axis=1)
    return Surface(vertices, triangles, np.full((count + 1, 2), [0.5, v]))


def lathe(profile: ArrayLike, sides: int = 16) -> Surface:
    """Surface of revolution about z of a profile of (radius, height) [m], bottom to top."""
    radius_height = np.asarray(profile, float)
    angle = np.linspace(0.0, 2.0 * math.pi, sides, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rings = np.empty((len(radius_height), sides, 3))
    rings[..., :2] = radius_height[:, None, :1] * circle
    rings[..., 2] = radius_height[:, 1:]
    return loft(rings)


def cylinder(radius: float, length: float, sides: int = 14) -> Surface:
    """Cylinder about z, centred at the origin."""
    return lathe([(radius, -length / 2), (radius, length / 2)], sides)


def box(x: float, y: float, z: float) -> Surface:
    """Box centred at the origin; each face carries the whole texture upright."""
    cube = _cube()
    return Surface(cube.vertices * (np.array([x, y, z]) / 2), cube.triangles, cube.uvs)


@lru_cache(maxsize=1)
def _cube() -> Surface:
    """The box of half side 1; rooms are made of hundreds."""
    return join([_face(axis, sign) for axis in range(3) for sign in (1, -1)])


def _face(axis: int, sign: int) -> Surface:
    normal = np.eye(3)[axis] * sign
    up = np.eye(3)[2] if axis < 2 else np.eye(3)[1]
    right = np.cross(up, normal)
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    vertices = np.array([normal + a * right + b * up for a, b in corners])
    uvs = np.array([((a + 1) / 2, (1 - b) / 2) for a, b in corners])
    return Surface(vertices, np.array([[0, 1, 2], [0, 2, 3]]), uvs)


def slab(outline: ArrayLike, thickness: float) -> Surface:
    """Prism of an outline (n, 2) in the x-z plane, star-shaped about its mean, centred on y = 0."""
    xz = np.asarray(outline, float)
    rings = np.empty((2, len(xz), 3))
    rings[:, :, 0], rings[:, :, 2] = xz[:, 0], xz[:, 1]
    rings[0, :, 1], rings[1, :, 1] = thickness / 2, -thickness / 2
    return loft(rings)


def ball(radius: float, subdivisions: int = 2) -> Surface:
    """Icosphere; the texture wraps by longitude and height."""
    vertices, triangles = _icosahedron()
    for _ in range(subdivisions):
        vertices, triangles = _subdivided(vertices, triangles)
    u = np.arctan2(vertices[:, 1], vertices[:, 0]) / (2 * math.pi) + 0.5
    return Surface(vertices * radius, triangles, np.stack([u, (1 - vertices[:, 2]) / 2], axis=1))


def _icosahedron() -> tuple[Floats, Ints]:
    height, radius = 1 / math.sqrt(5), 2 / math.sqrt(5)
    angle = np.arange(5) * 2 * math.pi / 5
    lower = np.stack([np.cos(angle), np.sin(angle), np.full(5, -0.5)], axis=1)
    upper = np.stack([np.cos(angle + math.pi / 5), np.sin(angle + math.pi / 5), np.full(5, 0.5)], 1)
    rings = np.concatenate([lower, upper]) * [radius, radius, 2 * height]
    i, j = np.arange(5), (np.arange(5) + 1) % 5
    sides = np.concatenate([np.stack([i, j, i + 5], 1), np.stack([j, j + 5, i + 5], 1)])
    ends = np.concatenate(
        [np.stack([j, i, np.full(5, 10)], 1), np.stack([i + 5, j + 5, np.full(5, 11)], 1)]
    )
    return np.concatenate([rings, [[0, 0, -1], [0, 0, 1]]]), np.concatenate([sides, ends])


def _subdivided(vertices: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middle = vertices[unique].mean(axis=1)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    ab, bc, ca = (inverse.reshape(-1, 3) + len(vertices)).T
    a, b, c = triangles.T
    corners = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    return np.concatenate([vertices, middle]), np.concatenate([np.stack(t, 1) for t in corners])
