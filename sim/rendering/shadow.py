"""Shadows on flat ground without a shadow pass: the object's mesh pressed flat along the sun.

The renderer draws them as ordinary surfaces just above the floor, with the floor's own texture made
darker. Objects do not shade one another; that is the price of a picture in 20 ms on a CPU.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.assets.asset import Asset, Mesh
from sim.assets.surface import rotation
from sim.assets.texture import Texture
from sim.rendering.ground import TILE
from sim.scenes.model import PlacedObject, Sun

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


def shadow_mesh(asset: Asset, placed: PlacedObject, sun: Sun, floor: Texture) -> Mesh:
    """The shadow in world coordinates, made of the triangles that face the sun."""
    to_sun = toward_sun(sun)
    slope = to_sun[:2] / to_sun[2]
    slope *= min(1.0, LONGEST / max(float(np.hypot(*slope)), 1e-9))
    pose = placed.world_from_object
    turn = rotation(0, 0, pose.yaw)
    flat: list[NDArray[np.float64]] = []
    for mesh in asset.meshes:
        points = (mesh.vertices * placed.scale) @ turn.T
        lit = (mesh.normals @ turn.T @ to_sun)[mesh.triangles].sum(axis=1) > 0
        corners = points[mesh.triangles[lit]].reshape(-1, 3)
        flat.append(corners[:, :2] - np.maximum(corners[:, 2:], 0) * slope + [pose.x, pose.y])
    ground = np.concatenate(flat)
    vertices = np.column_stack([ground, np.full(len(ground), LIFT)])
    normals = np.tile([0.0, 0.0, 1.0], (len(ground), 1))
    triangles = np.arange(len(ground)).reshape(-1, 3)
    return Mesh(vertices, normals, ground / TILE, triangles, floor, 1.0)
