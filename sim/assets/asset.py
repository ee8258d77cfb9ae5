"""What an object is made of: painted parts for the camera, simple shapes for physics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sim.assets.normals import shaded
from sim.assets.surface import Surface, join
from sim.assets.texture import Color, Texture

GLOSSY = 0.7


@dataclass(frozen=True)
class Part:
    """A surface with a texture (modulated by `color`) or a plain colour."""

    surface: Surface
    color: Color = (1.0, 1.0, 1.0)
    texture: Texture | None = None
    roughness: float = 0.8
    """1 is matt, 0 a mirror; below `GLOSSY` a highlight of the sun shows."""


@dataclass(frozen=True)
class CollisionShape:
    """A box of half extents, a z-cylinder of (radius, radius, half height) or a ball [m]."""

    kind: Literal["box", "cylinder", "ball"]
    center: tuple[float, float, float]
    half: tuple[float, float, float]


@dataclass(frozen=True)
class Mesh:
    """Arrays for the renderer: vertices, normals (n, 3), uvs (n, 2), triangles (m, 3), texture."""

    vertices: NDArray[np.float64]
    normals: NDArray[np.float64]
    uvs: NDArray[np.float64]
    triangles: NDArray[np.int64]
    texture: Texture
    roughness: float


@dataclass(frozen=True, eq=False)
class Asset:
    """One look of one class, standing on z = 0 around the origin, front along +x."""

    label: str
    parts: tuple[Part, ...]
    collisions: tuple[CollisionShape, ...]

    @cached_property
    def meshes(self) -> tuple[Mesh, ...]:
        """What the renderer draws; made when first asked for, because physics does without.

        Plain parts are joined, because a draw call costs more than size.
        """
        plain = [part for part in self.parts if part.texture is None]
        meshes = [_textured(part) for part in self.parts if part.texture is not None]
        for glossy in (False, True):
            alike = [part for part in plain if (part.roughness < GLOSSY) == glossy]
            meshes += [_palette(alike)] if alike else []
        return tuple(meshes)

    @cached_property
    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest x, y, z (3,) of all vertices [m]."""
        vertices = np.concatenate([part.surface.vertices for part in self.parts])
        return vertices.min(axis=0), vertices.max(axis=0)

    @property
    def size(self) -> tuple[float, float, float]:
        """Extent of the bounding box along x, y, z [m]."""
        low, high = self.bounds
        return _triple(high - low)

    @cached_property
    def footprint_radius(self) -> float:
        """Radius [m] of the circle around the origin that holds every collision shape."""
        return max(_reach(shape) for shape in self.collisions)

    @property
    def triangle_count(self) -> int:
        """Triangles of all meshes."""
        return sum(len(mesh.triangles) for mesh in self.meshes)


def _reach(shape: CollisionShape) -> float:
    center = float(np.hypot(*shape.center[:2]))
    return center + (float(np.hypot(*shape.half[:2])) if shape.kind == "box" else shape.half[0])


def _textured(part: Part) -> Mesh:
    assert part.texture is not None
    surface, normals = shaded(part.surface)
    texture = (part.texture * np.asarray(part.color)).astype(np.uint8)
    return Mesh(surface.vertices, normals, surface.uvs, surface.triangles, texture, part.roughness)


def _palette(parts: Sequence[Part]) -> Mesh:
    """Plain parts as one mesh; its texture has one 4x4 cell for each colour."""
    texture = np.concatenate([np.full((4, 4, 3), np.asarray(p.color) * 255) for p in parts], axis=1)
    painted: list[Surface] = []
    for index, part in enumerate(parts):
        center = np.full_like(part.surface.uvs, [(index + 0.5) / len(parts), 0.5])
        painted.append(Surface(part.surface.vertices, part.surface.triangles, center))
    piece = np.repeat(np.arange(len(parts)), [len(s.vertices) for s in painted])
    surface, normals = shaded(join(painted), piece)
    roughness = float(np.mean([part.roughness for part in parts]))
    return Mesh(
        surface.vertices,
        normals,
        surface.uvs,
        surface.triangles,
        texture.astype(np.uint8),
        roughness,
    )


def box_shape(low: Sequence[float], high: Sequence[float]) -> CollisionShape:
    """Collision box between two corners [m]."""
    center = (np.asarray(low, float) + np.asarray(high, float)) / 2
    half = np.asarray(high, float) - center
    return CollisionShape("box", _triple(center), _triple(half))


def cylinder_shape(radius: float, low: float, high: float) -> CollisionShape:
    """Upright collision cylinder around the z axis between two heights [m]."""
    half = (radius, radius, (high - low) / 2)
    return CollisionShape("cylinder", (0.0, 0.0, (low + high) / 2), half)


def _triple(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def assemble(label: str, parts: Sequence[Part], collisions: Sequence[CollisionShape]) -> Asset:
    """An asset of parts and collision shapes."""
    return Asset(label, tuple(parts), tuple(collisions))
