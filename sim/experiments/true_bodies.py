"""Things of a world as bodies in space, as they truly are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2, Pose3
from schemas.perception import SOLID_KINDS, Bodies
from services.perception.space.solids import solids_of
from sim.assets.library import bounds
from sim.scenes.model import PlacedObject


@dataclass(frozen=True)
class TrueBody:
    """The box around one thing."""

    id: str
    label: str
    world_from_box: Pose3
    """z up in its own frame, x along the longer side, the origin in the middle."""
    size: Floats
    """(3,) [m]"""


def true_body(placed: PlacedObject, world_from_thing: Pose3 | None = None) -> TrueBody:
    """The body of an object, at another pose than where it was placed if one is given."""
    pose = world_from_thing or _standing(placed)
    low, high = bounds(placed.label, placed.look)
    x, y, z = (placed.scale * (low + high) / 2).tolist()
    level, size = Pose3((x, y, z), (1.0, 0.0, 0.0, 0.0)), placed.scale * (high - low)
    if size[1] > size[0]:
        level = Pose3((x, y, z), Pose2(0, 0, math.pi / 2).lifted().wxyz)
        size = size[[1, 0, 2]]
    whole = pose @ level
    # A ball has rolled a little, and looks the same.
    turn = (1.0, 0.0, 0.0, 0.0) if placed.label == "ball" else whole.wxyz
    return TrueBody(placed.id, placed.label, Pose3(whole.position, turn), size)


def message_of(
    bodies: Sequence[TrueBody],
    base_from_world: Pose3,
    odom_from_base: Pose2,
    variances: Sequence[float],
    stamp_ns: int = 0,
) -> Bodies:
    """Bodies as perception tells them.

    Args:
        bodies: that were seen, N of them.
        base_from_world: at the picture.
        odom_from_base: dead reckoning at the picture.
        variances: (N,) of their places, in each direction [m^2].
        stamp_ns: of the picture.
    """
    poses = [base_from_world @ body.world_from_box for body in bodies]
    solids = [
        (row, solid)
        for row, body in enumerate(bodies)
        for solid in solids_of(body.label, body.size)
    ]
    return Bodies(
        stamp_ns=stamp_ns,
        odom_from_base=odom_from_base,
        positions_base=_rows([pose.position for pose in poses], 3),
        wxyz_base=_rows([pose.wxyz for pose in poses], 4),
        covariances=np.array(variances)[:, None, None] * np.eye(6),
        sizes=_rows([body.size for body in bodies], 3),
        solid_rows=np.array([row for row, _ in solids], np.int32),
        solid_kinds=np.array([SOLID_KINDS.index(solid.kind) for _, solid in solids], np.int32),
        solid_centers=_rows([solid.center for _, solid in solids], 3),
        solid_sizes=_rows([solid.size for _, solid in solids], 3),
    )


def _standing(placed: PlacedObject) -> Pose3:
    x, y = placed.world_from_object.x, placed.world_from_object.y
    return Pose3((x, y, placed.height), placed.world_from_object.lifted().wxyz)


def _rows(rows: Sequence[Sequence[float] | Floats], columns: int) -> Floats:
    return np.array(rows, np.float64).reshape(-1, columns)
