"""Shadows on level surfaces without a shadow pass: the mesh pressed flat along the sun.

The renderer draws them as ordinary surfaces just above the floor or the table, with its own texture
made darker. Objects do not shade one another; that is the price of a picture in 20 ms on a CPU.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from schemas.geometry import Pose3
from sim.assets.asset import Asset, Mesh
from sim.rendering.ground import Covering
from sim.scenes.model import Sun

LIFT = 0.004
"""Height above the floor [m], enough to win the depth test at 30 m."""
LONGEST = 2.5
"""Longest shadow in heights of the object, so that a low sun does not darken the whole floor."""


def toward_sun(sun: Sun) -> NDArray[np.float64]:
    """Unit vector (3,) from the ground to the sun."""
    level = math.cos(sun.elevation)
    return np.array(
        [level * math.cos(sun.azimuth), level * math.sin(sun.azimuth), math.sin(sun.elevation)]
    )


def shadow_brightness(sun: Sun) -> float:
    """Display value of shaded floor relative to sunlit floor: what is left is the sky's light."""
    direct = sun.color[1] * math.sin(sun.elevation)
    return (sun.ambient / (sun.ambient + direct)) ** (1 / 2.2)


def shadow_mesh(
    asset: Asset,
    world_from_asset: Pose3,
    scale: float,
    sun: Sun,
    covering: Covering,
    height: float = 0.0,
) -> Mesh:
    """The shadow on a level surface at a height [m], made of the triangles that face the sun."""
    to_sun = toward_sun(sun)
    slope = to_sun[:2] / to_sun[2]
    slope *= min(1.0, LONGEST / max(float(np.hypot(*slope)), 1e-9))
    turn, place = world_from_asset.rotation(), np.array(world_from_asset.position) - [0, 0, height]
    flat: list[NDArray[np.float64]] = []
    for mesh in asset.meshes:
        points = (mesh.vertices * scale) @ turn.T + place
        lit = (mesh.normals @ turn.T @ to_sun)[mesh.triangles].sum(axis=1) > 0
        corners = points[mesh.triangles[lit]].reshape(-1, 3)
        flat.append(corners[:, :2] - np.maximum(corners[:, 2:], 0) * slope)
    ground = np.concatenate(flat)
    vertices = np.column_stack([ground, np.full(len(ground), height + LIFT)])
    normals = np.tile([0.0, 0.0, 1.0], (len(ground), 1))
    triangles = np.arange(len(ground)).reshape(-1, 3)
    return Mesh(vertices, normals, ground / covering.tile, triangles, covering.texture, 1.0)
