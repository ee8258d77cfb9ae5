"""How far it is to drive to any place, round the obstacles known so far."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from schemas.arrays import Flags, Floats
from services.policy.terrain import Terrain

_neighbours = ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1))
"""Steps down and across, in the order of the indices they lead to."""


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
    distance = csgraph.dijkstra(_graph(passable), indices=first)
    return Travel(start, terrain, terrain.resolution * np.reshape(distance, passable.shape))


def _graph(passable: Flags) -> sparse.csr_matrix:
    """Steps between neighbours, both ways: the rows of a sparse matrix, written down directly."""
    padded = np.pad(passable, 1)
    columns = passable.shape[1]
    fits = np.stack([_shifted(padded, *step) & passable for step in _neighbours], axis=-1)
    index = np.arange(passable.size, dtype=np.int32)[:, None]
    ends = index + np.array([down * columns + across for down, across in _neighbours], np.int32)
    fits = fits.reshape(ends.shape)
    lengths = np.broadcast_to(np.hypot(*np.transpose(_neighbours)), ends.shape)
    starts = np.concatenate([[0], np.cumsum(fits.sum(axis=1))])
    return sparse.csr_matrix((lengths[fits], ends[fits], starts), shape=(index.size, index.size))


def _shifted(padded: Flags, down: int, across: int) -> Flags:
    """What lies that many blocks down and across, from an array with a rim of one block."""
    rows, columns = padded.shape
    return padded[1 + down : rows - 1 + down, 1 + across : columns - 1 + across]
