"""Draws suites of rooms: floors, walls with doorways, ceilings, light, and the furniture.

Nothing shades anything: light comes evenly from the ceiling and a little more from one side, as
through windows that are not drawn.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Generator as Steps
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import sapien
from numpy.random import Generator
from sapien import render

from robots.spec import CameraSpec
from sim.assets.asset import Asset, Part, assemble
from sim.assets.furniture_library import make_furniture
from sim.assets.furniture_parts import WOODS, block, grain, speckled, wood_or_paint
from sim.assets.surface import Surface
from sim.assets.texture import Color, Texture, bricks, hsv, mottled, pick, shade
from sim.rendering.bodies import entity, render_body
from sim.rendering.camera import Camera
from sim.scenes.floor_plan import Rectangle
from sim.scenes.rooms import DOOR_HEIGHT, Room, Suite, turned

_skirting = 0.08
_tile = 2.0
"""Side of one repetition of a floor's texture [m]."""


class RoomStudio:
    """A scene with a camera, in which suites are shown one after another."""

    def __init__(self, spec: CameraSpec) -> None:
        self._scene = sapien.Scene([render.RenderSystem()])
        self.camera = Camera(self._scene, spec.width, spec.height, spec.horizontal_fov)

    @contextmanager
    def showing(self, suite: Suite, rng: Generator) -> Steps[RoomStage]:
        """Put a suite up, and take it off again."""
        stage = RoomStage(self._scene, suite, rng)
        yield stage
        stage.strike()


class RoomStage:
    """A suite in a scene; it can be taken off again.

    The scene must have a `RenderSystem`: SAPIEN ends the process when a render body is added to a
    scene without one.
    """

    def __init__(self, scene: sapien.Scene, suite: Suite, rng: Generator) -> None:
        self._scene = scene
        self._entities: list[sapien.Entity] = []
        self._light(rng)
        for room in suite.rooms:
            self._show(room_shell(room, suite.doors))
        for door in suite.doors:
            self._show(door_frame(door, rng))
        for piece in suite.pieces:
            self.put(
                make_furniture(piece.label, piece.look),
                *_pose(piece.pose.x, piece.pose.y, 0, piece.pose.yaw),
            )

    def put(self, asset: Asset, position: list[float], wxyz: list[float]) -> None:
        """Show an asset anywhere."""
        shown = entity(render_body(asset.meshes))
        shown.set_pose(sapien.Pose(position, wxyz))
        self._add(shown)

    def strike(self) -> None:
        """Take everything off the scene."""
        for made in self._entities:
            made.remove_from_scene()
        self._entities.clear()

    def _show(self, asset: Asset) -> None:
        self._add(entity(render_body(asset.meshes)))

    def _light(self, rng: Generator) -> None:
        bright, warm = rng.uniform(0.45, 1.05), rng.uniform(0.75, 1.08)
        self._scene.set_ambient_light([bright, bright * (0.5 + 0.5 * warm), bright * warm])
        lamp = render.RenderDirectionalLightComponent()
        lamp.set_color([rng.uniform(0.1, 0.8)] * 3)
        lamp.shadow = False
        shining = entity(lamp)
        shining.set_pose(_pose_along(rng.uniform(-math.pi, math.pi), rng.uniform(0.4, 1.3)))
        self._add(shining)

    def _add(self, made: sapien.Entity) -> None:
        made.add_to_scene(self._scene)
        self._entities.append(made)


def room_shell(room: Room, doors: tuple[Rectangle, ...]) -> Asset:
    """Floor, walls with openings, skirting and ceiling of a room, in world coordinates."""
    rng = np.random.default_rng([room.look, 3])
    x0, y0, x1, y1 = room.floor
    floor = _quad([(x0, y0, 0), (x1, y0, 0), (x1, y1, 0), (x0, y1, 0)])
    above = _quad(
        [(x0, y1, room.height), (x1, y1, room.height), (x1, y0, room.height), (x0, y0, room.height)]
    )
    covering = floor_texture(rng, room.kind)
    parts = [
        Part(floor.tiled(room.width / _tile, room.depth / _tile), texture=covering, roughness=0.6),
        Part(above.tiled(room.width / 1.2, room.depth / 1.2), texture=ceiling_texture(rng)),
    ]
    paint, skirting = _paint(rng), pick(rng, [(0.9, 0.9, 0.88), (0.25, 0.22, 0.2)], 0.05)
    two_tone = rng.uniform(0.9, 1.3) if rng.random() < 0.25 else 0.0
    for side in range(4):
        for begin, end, low in _solid(room, side, doors):
            levels = [low, *(z for z in (_skirting, two_tone) if z > low), room.height]
            for bottom, top in itertools.pairwise(levels):
                color = {_skirting: skirting, two_tone: shade(paint, 0.75)}.get(top, paint)
                parts.append(Part(_wall(room, side, (begin, end), (bottom, top)), color))
    return assemble("room", parts, [])


def door_frame(door: Rectangle, rng: Generator) -> Asset:
    """The frame of an open doorway, and the floor in it."""
    color, (x0, y0, x1, y1) = wood_or_paint(rng), door
    side = 0 if y1 - y0 < x1 - x0 else 1
    (begin, near), (end, far) = turned(side, x0, y0), turned(side, x1, y1)
    deep, middle = abs(far - near) + 0.03, (near + far) / 2

    def beam(at: float, long: float, z: float, high: float) -> Part:
        size, where = turned(side, long, deep), turned(side, at, middle)
        return block((*size, high), (*where, z), color, 0.6)

    parts = [beam(at, 0.06, DOOR_HEIGHT / 2, DOOR_HEIGHT) for at in (begin + 0.03, end - 0.03)]
    parts.append(beam((begin + end) / 2, end - begin, DOOR_HEIGHT - 0.03, 0.06))
    parts.append(beam((begin + end) / 2, end - begin, 0.0, 0.01))
    return assemble("door frame", parts, [])


def floor_texture(rng: Generator, kind: str) -> Texture:
    """Tiles, boards, carpet or linoleum; most kinds of room have some more often than others."""
    usual = {
        "kitchen": "tiles boards linoleum", "office": "carpet boards linoleum",
        "hallway": "linoleum tiles carpet", "lab": "linoleum tiles",
        "lounge": "boards carpet", "elevator": "tiles linoleum",
        "conference room": "carpet boards", "cafeteria": "tiles linoleum boards",
    }[kind].split()  # fmt: skip
    covering = (
        rng.choice(usual) if rng.random() < 0.8 else rng.choice(["tiles", "boards", "carpet"])
    )
    if covering == "boards":
        return grain(rng, pick(rng, WOODS, 0.03), 128)
    if covering == "carpet":
        return mottled(
            rng, hsv(rng.random(), rng.uniform(0, 0.4), rng.uniform(0.2, 0.6)), 0.14, 64, 0.3
        )
    color = hsv(rng.random(), rng.uniform(0, 0.15), rng.uniform(0.35, 0.85))
    if covering == "tiles":
        return bricks(rng, color, shade(color, rng.uniform(0.6, 0.9)), int(rng.choice([4, 8])), 128)
    return speckled(rng, color, 0.08)


def ceiling_texture(rng: Generator) -> Texture:
    """Panels of 1.2 m with or without a light in them, or plain plaster."""
    image = np.full((48, 48, 3), rng.uniform(0.7, 0.95) * 255)
    if rng.random() < 0.7:
        image[::24] = image[:, ::24] = rng.uniform(0.5, 0.7) * 255
    if rng.random() < 0.7:
        image[14:34, 16:32] = 255
    return image.astype(np.uint8)


def _paint(rng: Generator) -> Color:
    if rng.random() < 0.6:
        return pick(rng, [(0.9, 0.9, 0.88), (0.85, 0.82, 0.74), (0.75, 0.77, 0.78)], 0.03)
    return hsv(rng.random(), rng.uniform(0.1, 0.5), rng.uniform(0.5, 0.9))


def _solid(
    room: Room, side: int, doors: tuple[Rectangle, ...]
) -> Iterator[tuple[float, float, float]]:
    """Stretches of a wall: begin, end, and the height from which there is wall [m]."""
    begin, end = (turned(side, *room.floor[i : i + 2])[0] for i in (0, 2))
    near = _line(room, side)
    gaps = sorted(
        (turned(side, *door[:2])[0], turned(side, *door[2:])[0])
        for door in doors
        if min(abs(turned(side, *door[i : i + 2])[1] - near) for i in (0, 2)) < 1e-6
        and turned(side, *door[:2])[0] < end
        and turned(side, *door[2:])[0] > begin
    )
    for low, high in gaps:
        yield begin, low, 0.0
        yield low, high, DOOR_HEIGHT
        begin = high
    yield begin, end, 0.0


def _line(room: Room, side: int) -> float:
    """Where a wall stands, across its direction."""
    return turned(side, *room.floor[:2] if side in (0, 3) else room.floor[2:])[1]


def _wall(
    room: Room, side: int, along: tuple[float, float], heights: tuple[float, float]
) -> Surface:
    """An upright rectangle that is seen from inside the room."""
    line, (low, high) = _line(room, side), heights
    # Surfaces are seen from one side only; from inside, walls 0 and 1 run against their axis.
    begin, end = along if side in (0, 1) else along[::-1]
    one, other = turned(side, begin, line), turned(side, end, line)
    return _quad([(*other, low), (*one, low), (*one, high), (*other, high)])


def _quad(corners: list[tuple[float, float, float]]) -> Surface:
    """A rectangle, front where its corners run counter-clockwise; the texture fills it once."""
    uvs = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], float)
    return Surface(np.array(corners, float), np.array([[0, 1, 2], [0, 2, 3]]), uvs)


def _pose(x: float, y: float, z: float, yaw: float) -> tuple[list[float], list[float]]:
    return [x, y, z], [math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]


def _pose_along(azimuth: float, pitch: float) -> sapien.Pose:
    """A pose whose x axis points along an azimuth and downwards by a pitch [rad]."""
    about_z = sapien.Pose(q=[math.cos(azimuth / 2), 0, 0, math.sin(azimuth / 2)])
    return about_z * sapien.Pose(q=[math.cos(pitch / 2), 0, math.sin(pitch / 2), 0])
