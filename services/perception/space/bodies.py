"""Located objects as the bodies of a message."""

import math
from collections.abc import Sequence

import numpy as np

from schemas.arrays import Floats
from schemas.perception import SOLID_KINDS, Bodies
from schemas.sensing import RgbdFrame
from services.perception.space.projection import LocatedObject
from services.perception.space.solids import solids_of

_tilt = 0.05
"""Deviation of what stands upright from that [rad]."""


def bodies_of(frame: RgbdFrame, labels: Sequence[str], located: Sequence[LocatedObject]) -> Bodies:
    """The objects of a frame, with the likeliest class of each."""
    solids = [
        (row, solid)
        for row, (label, one) in enumerate(zip(labels, located, strict=True))
        for solid in solids_of(label, one.size)
    ]
    halves = [one.facing.yaw / 2 for one in located]
    return Bodies(
        stamp_ns=frame.stamp_ns,
        odom_from_base=frame.odom_from_base,
        positions_base=_rows([one.center for one in located], 3),
        wxyz_base=_rows([np.array([math.cos(h), 0.0, 0.0, math.sin(h)]) for h in halves], 4),
        covariances=np.array([_covariance(one) for one in located]).reshape(-1, 6, 6),
        sizes=_rows([one.size for one in located], 3),
        solid_rows=np.array([row for row, _ in solids], np.int32),
        solid_kinds=np.array([SOLID_KINDS.index(solid.kind) for _, solid in solids], np.int32),
        solid_centers=_rows([solid.center for _, solid in solids], 3),
        solid_sizes=_rows([solid.size for _, solid in solids], 3),
    )


def _covariance(located: LocatedObject) -> Floats:
    """(6, 6) of place and turn, which are taken to be independent."""
    whole = np.diag([0.0, 0.0, 0.0, _tilt**2, _tilt**2, located.facing.deviation**2])
    whole[:3, :3] = located.covariance
    return whole


def _rows(rows: Sequence[Floats], columns: int) -> Floats:
    return np.array(rows, np.float64).reshape(-1, columns)
