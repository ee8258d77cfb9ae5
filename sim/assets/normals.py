"""Vertex normals that are smooth over curved parts and sharp at edges."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.assets.surface import Surface

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def shaded(
    surface: Surface, piece: Ints | None = None, crease: float = math.radians(42)
) -> tuple[Surface, Floats]:
    """The surface with vertices split at creases, and its unit normals (n, 3).

    A corner takes the area-weighted mean normal of the triangles around its position that are
    turned by less than `crease` [rad] from its own and are of the same `piece` (n,), a number
    for every vertex. Degenerate triangles are dropped.
    """
    corners = surface.vertices[surface.triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(area, axis=1)
    kept = size > 1e-12
    triangles, area, size = surface.triangles[kept], area[kept], size[kept]
    position = _position_ids(surface.vertices, piece)[triangles].ravel()
    first, second = _pairs_with_equal_id(position)
    face, other = first // 3, second // 3
    unit = area / size[:, None]
    close = np.einsum("ij,ij->i", unit[face], unit[other]) > math.cos(crease)
    normals = np.stack(
        [np.bincount(first[close], area[other[close], k], len(position)) for k in range(3)], axis=1
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return _welded(surface.vertices[triangles.ravel()], surface.uvs[triangles.ravel()], normals)


def _position_ids(vertices: Floats, piece: Ints | None) -> Ints:
    pieces = np.zeros(len(vertices), np.int64) if piece is None else piece
    return _row_ids(np.column_stack([np.round(vertices * 1e5).astype(np.int64), pieces]))[1]


def _row_ids(rows: Ints) -> tuple[Ints, Ints]:
    """First index of each distinct row, and for every row the number of its distinct row."""
    order = np.lexsort(rows.T)
    changed = np.r_[True, np.any(np.diff(rows[order], axis=0) != 0, axis=1)]
    ids = np.empty(len(rows), np.int64)
    ids[order] = np.cumsum(changed) - 1
    return order[changed], ids


def _pairs_with_equal_id(ids: Ints) -> tuple[Ints, Ints]:
    order = np.argsort(ids, kind="stable")
    counts = np.bincount(ids)
    counts = counts[counts > 0]
    starts = np.repeat(np.r_[0, np.cumsum(counts)[:-1]], counts)
    size = np.repeat(counts, counts)
    first = np.repeat(np.arange(len(ids)), size)
    within = np.arange(len(first)) - np.repeat(np.r_[0, np.cumsum(size)[:-1]], size)
    return order[first], order[starts[first] + within]


def _welded(vertices: Floats, uvs: Floats, normals: Floats) -> tuple[Surface, Floats]:
    rows = np.round(np.concatenate([vertices * 1e5, uvs * 1e4, normals * 1e2], axis=1))
    first, ids = _row_ids(rows.astype(np.int64))
    return Surface(vertices[first], ids.reshape(-1, 3), uvs[first]), normals[first]
