"""Which open space belongs to which place, as far as the sensors tell without doubt.

Points are the pose nodes and the spots that were recognised from afar. Two points lie in one place
if the ground between them is free and passes no doorway. This is the same in all hypotheses; how
they divide the pose nodes in regions is not.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from schemas.arrays import Flags, Floats, Ints
from services.mapping.floor import Floor, floor_around, occupied_from
from services.mapping.grid import Grid

_reach = 5.0
"""Points farther apart are not compared [m]."""
_candidates = 4
_two_places = 0.99
cell_size = 0.4
"""[m]"""
_log_overlooked = float(np.log(0.01))
"""The map errs, or a place is part of what looks like another."""
_beside = np.ones((3, 3), np.bool_)


@dataclass(frozen=True)
class Layout:
    """N pose nodes, M spots and C cells of free ground."""

    nodes: int
    """N"""
    node_of_spot: Ints
    """(M,) Pose node in the same place, -1 where the robot has not been."""
    group_of_spot: Ints
    """(M,) Spots of one such place have one number; -1 for those at pose nodes."""
    oldest: Ints
    """(G,) First spot of each of these places."""
    origin: Floats
    """Of the cells, map frame, shape (2,) [m]."""
    crowded: Flags
    """(Y, X) Cells with no room for the middle of a place that nobody saw: seen ones or walls lie
    here or beside it, or there is no way to them."""
    centers: Floats
    """(C, 2) of the cells that belong to a place, map frame [m]."""
    owner: Ints
    """(C,) Point in whose place the cell lies: a node, or N + a spot."""

    def log_unseen(self, points: Floats) -> Floats:
        """Log probability (...) that a place around points (..., 2) was not seen all the while."""
        cells = np.floor((points - self.origin) / cell_size).astype(np.intp)
        rows, columns = self.crowded.shape
        inside = np.all((cells >= 0) & (cells < (columns, rows)), axis=-1)
        x, y = np.where(inside, cells[..., 0], 0), np.where(inside, cells[..., 1], 0)
        return np.where(inside & self.crowded[y, x], _log_overlooked, 0.0)


def layout_of(nodes: Floats, spots: Floats, agrees: Floats, grid: Grid) -> Layout:
    """Lay out N nodes (N, 2) and M spots (M, 2).

    Args:
        nodes: map frame [m].
        spots: map frame [m].
        agrees: (M, N) how much better one type of place explains a spot and a node than two.
        grid: what the range finder saw.
    """
    points = np.concatenate([nodes, spots])
    floor = floor_around(points, grid)
    node_of_spot = _linked(spots, nodes, agrees, floor)
    alone = np.flatnonzero(node_of_spot < 0)
    group = np.full(len(spots), -1, np.int32)
    group[alone] = _groups(spots[alone], floor)
    oldest = alone[np.unique(group[alone], return_index=True)[1]].astype(np.int32)
    centers, owner = _ownership(points, floor)
    crowded = _crowded(centers, floor) | _closed(floor, grid)
    return Layout(len(nodes), node_of_spot, group, oldest, floor.origin, crowded, centers, owner)


def _linked(spots: Floats, nodes: Floats, agrees: Floats, floor: Floor) -> Ints:
    """Nearest pose node (M,) in the place of each spot, -1 for none."""
    linked = np.full(len(spots), -1, np.int32)
    if not len(spots):
        return linked
    for column in _nearest(nodes, spots):
        rows = np.flatnonzero((linked < 0) & (column < len(nodes)))
        near = column[rows]
        # Near a doorway one stands in two places, and what they look like decides.
        wide = floor.wide_between(spots[rows], nodes[near])
        one_place = wide | (agrees[rows, near] > _two_places)
        open_way = floor.open_between(spots[rows], nodes[near])
        linked[rows] = np.where(open_way & one_place, near, -1)
    return linked


def _groups(spots: Floats, floor: Floor) -> Ints:
    """Places (n,), numbered from 0, that spots (n, 2) lie in."""
    if not len(spots):
        return np.zeros(0, np.int32)
    pairs = KDTree(spots).query_pairs(_reach, output_type="ndarray")
    pairs = pairs[floor.open_between(spots[pairs[:, 0]], spots[pairs[:, 1]])]
    links = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (len(spots), len(spots)))
    _, labels = connected_components(links, directed=False)
    return labels.astype(np.int32)


def _ownership(points: Floats, floor: Floor) -> tuple[Floats, Ints]:
    """Centres (C, 2) of the cells that lie in the place of a point, and which point (C,)."""
    row, column = np.nonzero(floor.coarse(floor.free, cell_size).all(axis=(1, 3)))
    centers = floor.origin + cell_size * (np.stack([column, row], axis=1) + 0.5)
    owner = np.full(len(centers), -1, np.int32)
    for point in _nearest(points, centers):
        left = np.flatnonzero((owner < 0) & (point < len(points)))
        open_way = floor.open_between(centers[left], points[point[left]])
        owner[left] = np.where(open_way, point[left], -1)
    return centers[owner >= 0], owner[owner >= 0]


def _crowded(centers: Floats, floor: Floor) -> Flags:
    crowded: Flags = np.any(floor.coarse(floor.occupied, cell_size), axis=(1, 3))
    cells = np.floor((centers - floor.origin) / cell_size).astype(np.intp)
    crowded[cells[:, 1], cells[:, 0]] = True
    return np.asarray(ndimage.binary_dilation(crowded, _beside), np.bool_)


def _closed(floor: Floor, grid: Grid) -> Flags:
    """Blocks all of whose cells lie in pockets between walls, with no way to free ground."""
    # Nobody knows where ways outside the grid lead, which may be back into it.
    open_around = np.pad(grid.occupancy <= occupied_from, 1, constant_values=True)
    pocket = np.zeros(open_around.shape, np.int32)
    ndimage.label(open_around, output=pocket)
    column, row = np.rint((floor.origin - grid.origin) / grid.resolution).astype(int) + 1
    height, width = floor.free.shape
    inside = pocket[row : row + height, column : column + width]
    with_way = np.unique(np.append(inside[floor.free], pocket[0, 0]))
    closed: Flags = np.all(floor.coarse(~np.isin(inside, with_way), cell_size), axis=(1, 3))
    return closed


def _nearest(points: Floats, to: Floats) -> Ints:
    """Row k holds the k-th nearest of the points (p, 2) to each place (n, 2); p where none is."""
    _, near = KDTree(points).query(to, k=_candidates, distance_upper_bound=_reach)
    return np.asarray(near, np.int32).T
