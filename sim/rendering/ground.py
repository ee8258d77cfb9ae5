"""The floor: a large square with a seamless texture drawn from the ground's look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from sim.assets.asset import Mesh
from sim.assets.texture import Color, Texture, fractal, mixed, pick, shade
from sim.scenes.model import Ground, GroundKind

HALF_SIDE = 80.0
"""Half the side of the floor [m]."""
TILE = 6.0
"""Side of one repetition of the ground's texture [m]."""

COLORS: dict[GroundKind, list[Color]] = {
    "grass": [(0.36, 0.47, 0.22), (0.30, 0.42, 0.20), (0.48, 0.50, 0.26)],
    "asphalt": [(0.33, 0.33, 0.34), (0.42, 0.42, 0.42), (0.27, 0.27, 0.29)],
    "dirt": [(0.50, 0.40, 0.28), (0.58, 0.49, 0.36), (0.42, 0.33, 0.24)],
    "concrete": [(0.62, 0.61, 0.58), (0.70, 0.68, 0.64), (0.55, 0.55, 0.55)],
}


@dataclass(frozen=True, eq=False)
class Covering:
    """What a level surface is covered with."""

    texture: Texture
    tile: float
    """Side of one repetition of the texture [m]."""


def ground_covering(ground: Ground) -> Covering:
    """The covering of the open ground."""
    return Covering(ground_texture(ground), TILE)


def ground_texture(ground: Ground) -> Texture:
    """Colour of one tile, (256, 256, 3)."""
    rng = np.random.default_rng([ground.look, *ground.kind.encode()])
    color = pick(rng, COLORS[ground.kind], 0.02)
    contrast = {"grass": 0.16, "asphalt": 0.10, "dirt": 0.14, "concrete": 0.06}[ground.kind]
    weight = 0.5 + contrast * (fractal(rng, 256, 0.35) + 0.6 * fractal(rng, 256, 1.3))
    if ground.kind == "concrete":
        weight = _with_joints(weight, rng)
    return mixed(weight, shade(color, 0.55), shade(color, 1.4))


def _with_joints(weight: np.ndarray, rng: Generator) -> np.ndarray:
    step = int(rng.choice([64, 128]))
    joints = (np.arange(256)[:, None] % step < 2) | (np.arange(256)[None, :] % step < 2)
    return np.where(joints, weight - 0.35, weight)


def floor_mesh(covering: Covering) -> Mesh:
    """Two triangles around the origin at height zero."""
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float) * HALF_SIDE
    vertices = np.column_stack([corners, np.zeros(4)])
    normals = np.tile([0.0, 0.0, 1.0], (4, 1))
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    return Mesh(vertices, normals, corners / covering.tile, triangles, covering.texture, 1.0)
