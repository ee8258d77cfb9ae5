"""A layer of the scene: figures by name, drawn anew when the belief changes.

A figure that is not drawn again vanishes; one that is keeps its handle, so that the browser gets
only what changed.
"""

from collections.abc import Generator
from contextlib import contextmanager
from typing import TypeVar

import numpy as np
import viser

from robots.colours import Rgb
from schemas.arrays import Bytes, Floats, Floats32
from web.colours import linear
from web.shapes import Instances, Mesh

Figure = TypeVar("Figure", bound=viser.SceneNodeHandle)

_opacity_levels = np.geomspace(0.05, 0.5, 6)


class Layer:
    """All figures below one name of the scene tree, which can be hidden together."""

    def __init__(self, scene: viser.SceneApi, root: str) -> None:
        self._scene = scene
        self._root = root
        self.frame = scene.add_frame(root, show_axes=False)
        self._drawn: set[str] = set()
        self._figures: dict[str, viser.SceneNodeHandle] = {}

    @contextmanager
    def redraw(self) -> Generator[None]:
        """What is not drawn within this block is gone after it."""
        self._drawn = set()
        yield
        for name in set(self._figures) - self._drawn:
            self._figures.pop(name).remove()

    def lines(self, name: str, segments: Floats32, colour: Rgb, thickness: float) -> None:
        """Draw segments (N, 2, 3), `thickness` [m] wide."""
        if not len(segments):
            return
        known = self._known(name, viser.LineSegmentsHandle)
        if known and known.points.shape == segments.shape:
            known.points = segments
            return
        self._figures[name] = self._scene.add_line_segments(
            self._path(name), segments, colour, thickness=thickness
        )

    def label(self, name: str, text: str, position: Floats, scale: float = 0.8) -> None:
        """Write a label that always faces the viewer."""
        known = self._known(name, viser.LabelHandle)
        if known:
            known.text = text
            known.position = position
            return
        self._figures[name] = self._scene.add_label(
            self._path(name),
            text,
            position=position,
            font_screen_scale=scale,
            anchor="bottom-center",
        )

    def solid(self, name: str, mesh: Mesh, colour: Rgb, position: Floats, yaw: float = 0.0) -> None:
        """Draw one opaque body."""
        wxyz = (np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2))
        known = self._known(name, viser.MeshHandle)
        if known and np.array_equal(known.vertices, mesh.vertices) and known.color == colour:
            known.position, known.wxyz = position, wxyz
            return
        self._figures[name] = self._scene.add_mesh_simple(
            self._path(name),
            mesh.vertices,
            mesh.faces,
            color=colour,
            flat_shading=True,
            position=position,
            wxyz=wxyz,
            cast_shadow=False,
            receive_shadow=False,
        )

    def batch(self, name: str, mesh: Mesh, copies: Instances, colours: Bytes | Rgb) -> None:
        """Draw N opaque copies of a mesh at once, in one colour or one (N, 3) for each."""
        if len(copies.positions):
            tints = np.broadcast_to(linear(colours), (len(copies.positions), 3))
            self._draw(name, mesh, copies.padded(), tints, None)

    def translucent(self, name: str, mesh: Mesh, copies: Instances, colour: Rgb) -> None:
        """Draw N copies of a mesh at once, each with its own opacity."""
        if len(copies.positions):
            shown = copies.on_levels(_opacity_levels)
            self._draw(name, mesh, shown, linear(colour)[None], shown.opacities)

    def _draw(
        self, name: str, mesh: Mesh, copies: Instances, tints: Bytes, opacities: Floats | None
    ) -> None:
        size = len(copies.positions)
        positions, extents = copies.positions.astype(np.float32), copies.extents.astype(np.float32)
        colours = np.resize(tints, (size, 3))
        known = self._known(name, viser.BatchedMeshHandle)
        if known and len(known.batched_positions) == size:
            if not np.array_equal(known.batched_positions, positions):
                known.batched_positions = positions
            if known.batched_scales is None or np.any(known.batched_scales != extents):
                known.batched_scales = extents
            if not np.array_equal(known.batched_colors, colours):
                known.batched_colors = colours
            return
        self._figures[name] = self._scene.add_batched_meshes_simple(
            self._path(name),
            mesh.vertices,
            mesh.faces,
            np.tile(np.array([1, 0, 0, 0], np.float32), (size, 1)),
            positions,
            batched_scales=extents,
            batched_opacities=None if opacities is None else opacities.astype(np.float32),
            batched_colors=colours,
            flat_shading=True,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _known(self, name: str, kind: type[Figure]) -> Figure | None:
        self._drawn.add(name)
        figure = self._figures.get(name)
        return figure if isinstance(figure, kind) else None

    def _path(self, name: str) -> str:
        return f"{self._root}/{name}"
