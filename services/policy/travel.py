"""How far it is to drive to any place, round the obstacles known so far."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from schemas.arrays import Floats
from services.policy.terrain import Terrain

_neighbours = ((0, 1), (1, 0), (1, 1), (1, -1))


@dataclass(frozen=True)
class Travel:
    """Lengths of the shortest ways from one place."""

    start: Floats
    """(2,), map frame [m]"""
    terrain: Terrain
    distance: Floats
    """(Y, X) of the terrain's blocks, infinite where the base cannot get [m]."""

    def to(self, points: Floats) -> Floats:
        """Way to points (N, 2) [m]; to what lies off the terrain with the detour to its edge there.

        Steps from block to block make a straight way longer too; only what is longer than that
        is a detour.
        """
        row, column, inside = self.terrain.blocks(points)
        known = np.where(inside[:, None], points, self.terrain.centers(row, column))
        offset = np.abs(known - self.start)
        in_steps = offset.max(axis=1) + (np.sqrt(2) - 1) * offset.min(axis=1)
        least = self.distance[row, column] - self.terrain.resolution
        stretch = np.maximum(least / np.maximum(in_steps, 1e-9), 1.0)
        return np.hypot(*(points - self.start).T) * stretch


def travel_from(terrain: Terrain, start: Floats, radius: float) -> Travel:
    """Shortest ways from `start` (2,) for a base of `radius` [m]."""
    row, column, inside = terrain.blocks(start)
    if not inside:
        return Travel(start, terrain, np.full(terrain.occupied.shape, np.inf))
    rows, columns = np.indices(terrain.occupied.shape)
    near = np.hypot(rows - row, columns - column) * terrain.resolution < 2 * radius
    # A base that stands nearer to an obstacle than it should can still drive away from it.
    passable = (terrain.clearance >= radius) | (near & ~terrain.occupied)
    passable[row, column] = True
    first = int(np.ravel_multi_index((int(row), int(column)), passable.shape))
    distance = csgraph.dijkstra(_graph(passable), directed=False, indices=first)
    return Travel(start, terrain, terrain.resolution * np.reshape(distance, passable.shape))


def _graph(passable: np.ndarray) -> sparse.csr_matrix:
    rows, columns = passable.shape
    index = np.arange(passable.size).reshape(passable.shape)
    heads, tails, lengths = [], [], []
    for down, across in _neighbours:
        a = (slice(0, rows - down), slice(max(0, -across), columns - max(0, across)))
        b = (slice(down, rows), slice(max(0, across), columns - max(0, -across)))
        fits = passable[a] & passable[b]
        heads.append(index[a][fits])
        tails.append(index[b][fits])
        lengths.append(np.full(int(fits.sum()), np.hypot(down, across)))
    ends = (np.concatenate(heads), np.concatenate(tails))
    return sparse.csr_matrix((np.concatenate(lengths), ends), shape=(index.size, index.size))
