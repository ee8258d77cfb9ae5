"""Covariances of all objects at once, from the information matrix of the pose graph.

Asking the solver for them one by one is quick for what was seen last and slow for all else: a
tenth of a second for one object when 200 objects were seen from 500 poses. The matrix itself is
sparse, poses hang together in little more than a chain, and eliminating them leaves a small dense
matrix over the objects, whose inverse holds all that is asked for.
"""

from dataclasses import dataclass

import gtsam
import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from schemas.arrays import Floats

_point, _pose = 2, 3
"""Dimensions."""


@dataclass(frozen=True)
class Marginals:
    """Covariances in the map frame."""

    objects: Floats
    """(K, 2, 2) in the order of their numbers [m^2]."""
    last_pose: Floats
    """(3, 3) in the frame of the last pose: x, y [m^2] and yaw [rad^2]."""


def marginals_of(isam: gtsam.ISAM2, objects: int, poses: int) -> Marginals:
    """Covariances of all objects and of the last pose.

    Args:
        isam: holds objects, and poses, whose keys come after those of the objects.
        objects: number K of objects.
        poses: number of poses.

    Raises:
        RuntimeError: the matrix is singular.
    """
    information = information_of(isam, _point * objects + _pose * poses)
    split = _point * objects
    chain = splu(csc_matrix(information[split:, split:]), permc_spec="MMD_AT_PLUS_A")
    last = np.zeros((_pose * poses, _pose))
    last[-_pose:] = np.eye(_pose)
    across = csc_matrix(information[split:, :split]).toarray()
    solved: Floats = chain.solve(np.concatenate([across, last], axis=1))
    # Schur complement: what is left of the objects' information when the poses are summed out.
    left = csc_matrix(information[:split, :split]).toarray() - across.T @ solved[:, :split]
    covariance = np.linalg.inv(left)
    to_last = solved[-_pose:, :split]
    own = solved[-_pose:, split:] + to_last @ covariance @ to_last.T
    return Marginals(_blocks(covariance, objects), own)


def information_of(isam: gtsam.ISAM2, size: int) -> csc_matrix:
    """The information matrix (size, size) at the linearisation point, rows by ascending key."""
    linear = isam.getFactorsUnsafe().linearize(isam.getLinearizationPoint())
    row, column, value = linear.sparseJacobian_()
    rows, columns = row.astype(np.int32) - 1, column.astype(np.int32) - 1
    # The last column is the right side, which is of no interest here.
    kept = columns < size
    shape = (int(rows.max()) + 1, size)
    jacobian = csc_matrix((value[kept], (rows[kept], columns[kept])), shape)
    return csc_matrix(jacobian.transpose() @ jacobian)


def _blocks(covariance: Floats, count: int) -> Floats:
    grid = covariance.reshape(count, _point, count, _point)
    rows = np.arange(count)
    return grid[rows, :, rows, :]
