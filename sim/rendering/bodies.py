"""From our arrays to SAPIEN's render bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sapien
from sapien import render

from sim.assets.asset import Mesh
from sim.assets.texture import Texture

MIP_LEVELS = 6
"""Without smaller copies of a texture the distant ground flickers."""


def material(texture: Texture, roughness: float, brightness: float = 1.0) -> render.RenderMaterial:
    """A material that shows the texture times `brightness`."""
    made = render.RenderMaterial(
        base_color=[brightness, brightness, brightness, 1.0], roughness=roughness
    )
    made.base_color_texture = texture_2d(texture)
    return made


def texture_2d(texture: Texture) -> render.RenderTexture2D:
    """The texture on the device, repeated and filtered."""
    opaque = np.full((*texture.shape[:2], 1), 255, np.uint8)
    pixels = np.ascontiguousarray(np.concatenate([texture, opaque], axis=2))
    levels = min(MIP_LEVELS, int(np.log2(min(texture.shape[:2]))) + 1)
    return render.RenderTexture2D(pixels, "R8G8B8A8Unorm", levels, "linear", "repeat", False)


def mesh_shape(
    mesh: Mesh, surface: render.RenderMaterial, scale: float = 1.0
) -> render.RenderShapeTriangleMesh:
    """The mesh as a render shape."""
    return render.RenderShapeTriangleMesh(
        (mesh.vertices * scale).astype(np.float32),
        mesh.triangles.astype(np.uint32),
        mesh.normals.astype(np.float32),
        mesh.uvs.astype(np.float32),
        surface,
    )


def render_body(meshes: Sequence[Mesh], scale: float = 1.0) -> render.RenderBodyComponent:
    """A render body with one shape a mesh."""
    body = render.RenderBodyComponent()
    for mesh in meshes:
        body.attach(mesh_shape(mesh, material(mesh.texture, mesh.roughness), scale))
    return body


def entity(*components: sapien.Component) -> sapien.Entity:
    """An entity that holds the components and is in no scene yet."""
    made = sapien.Entity()
    for component in components:
        made.add_component(component)
    return made
