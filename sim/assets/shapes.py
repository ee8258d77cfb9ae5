"""Rounded boxes, tubes and boxes with a picture for each direction, built on `surface`."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from sim.assets.surface import Floats, Surface, box, loft


def outline(x: float, y: float, radius: float, segments: int = 3) -> Floats:
    """Rectangle x by y [m] around the origin with round corners, (n, 2), counter-clockwise."""
    angle = np.linspace(0.0, math.pi / 2, segments + 1)
    corner = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    middle = np.array([x / 2 - radius, y / 2 - radius])
    points: list[Floats] = []
    for quarter, (a, b) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        c, s = math.cos(quarter * math.pi / 2), math.sin(quarter * math.pi / 2)
        points.append(corner @ np.array([[c, s], [-s, c]]) + middle * [a, b])
    return np.concatenate(points)


def rounded_box(
    x: float, y: float, z: float, radius: float, bevel: float = 0.0, segments: int = 3
) -> Surface:
    """Box centred at the origin with round upright edges, bevelled above and below [m]."""
    inner = outline(x - 2 * bevel, y - 2 * bevel, max(radius - bevel, 1e-4), segments)
    outer = outline(x, y, radius, segments)
    levels = [(inner, -z / 2), (outer, bevel - z / 2), (outer, z / 2 - bevel), (inner, z / 2)]
    kept = levels if bevel > 0 else levels[1:3]
    return loft(np.array([np.column_stack([ring, np.full(len(ring), h)]) for ring, h in kept]))


def tube(
    path: ArrayLike, radius: ArrayLike, sides: int = 8, across: ArrayLike = (0.0, 1.0, 0.0)
) -> Surface:
    """Round tube along a path (n, 3) with one radius or (n,) radii [m].

    `across` is a direction that the path never takes; for a path in a plane, the plane's normal.
    """
    points = np.asarray(path, float)
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    first = np.cross(np.asarray(across, float), along)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(along, first)
    angle = np.linspace(0.0, 2 * math.pi, sides, endpoint=False)
    circle = np.cos(angle)[:, None, None] * first + np.sin(angle)[:, None, None] * second
    radii = np.broadcast_to(np.asarray(radius, float), len(points))
    return loft(points[:, None] + radii[:, None, None] * circle.transpose(1, 0, 2))


def arc(radius: float, start: float, end: float, count: int = 8, stretch: float = 1.0) -> Floats:
    """Points (n, 3) of an arc in the x-z plane between two angles [rad]; z is stretched."""
    angle = np.linspace(start, end, count)
    ring = [radius * np.cos(angle), np.zeros(count), stretch * radius * np.sin(angle)]
    return np.stack(ring, axis=1)


def atlas_box(x: float, y: float, z: float) -> Surface:
    """Box at the origin whose texture has three columns: for the faces along x, y and z."""
    plain = box(x, y, z)
    column = np.repeat(np.arange(3), 8)
    # Kept off the seams, where a smaller copy of the texture mixes the columns.
    u = (column + 0.02 + 0.96 * plain.uvs[:, 0]) / 3
    return Surface(plain.vertices, plain.triangles, np.column_stack([u, plain.uvs[:, 1]]))
