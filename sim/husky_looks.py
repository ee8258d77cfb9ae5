"""How the Husky looks: yellow deck and bumpers, black body, cleated tyres, a mast with a camera."""

from __future__ import annotations

import math

from robots.spec import RobotSpec
from sim.assets.asset import Mesh, Part, assemble
from sim.assets.surface import box, cylinder, lathe, slab
from sim.assets.texture import Color

YELLOW: Color = (0.95, 0.76, 0.05)
BLACK: Color = (0.07, 0.07, 0.08)
RUBBER: Color = (0.16, 0.16, 0.17)
GREY: Color = (0.50, 0.51, 0.53)


def chassis_meshes(spec: RobotSpec) -> tuple[Mesh, ...]:
    """Body, bumpers, deck rails, mast, camera and laser in the base frame."""
    parts = [*_body(spec), *_mast(spec), *_laser(spec)]
    return assemble("husky", parts, ()).meshes


def _body(spec: RobotSpec) -> list[Part]:
    base = spec.base
    half, wide = base.length / 2, base.track - 0.12
    low, high = 0.13, base.height
    outline = [
        (-half * 0.93, low + 0.06),
        (-half * 0.75, low),
        (half * 0.75, low),
        (half * 0.93, low + 0.06),
        (half * 0.86, high - 0.08),
        (-half * 0.86, high - 0.08),
    ]
    parts = [Part(slab(outline, wide), BLACK)]
    deck = box(base.length * 0.72, wide + 0.02, 0.03).at((0, 0, high - 0.06))
    parts += [Part(deck, YELLOW, roughness=0.5)]
    for end in (-1, 1):
        bumper = box(0.06, base.width * 0.8, 0.10).at((end * half * 0.95, 0, low + 0.10))
        nose = box(0.20, wide * 0.98, 0.03).at(
            (end * half * 0.76, 0, high - 0.09), (0, end * 0.55, 0)
        )
        parts += [Part(bumper, YELLOW, roughness=0.5), Part(nose, YELLOW, roughness=0.5)]
        rail = box(base.length * 0.7, 0.03, 0.03).at((0, end * wide * 0.46, high - 0.015))
        parts.append(Part(rail, GREY))
    return parts


def _mast(spec: RobotSpec) -> list[Part]:
    x, y, z = spec.camera.base_from_camera.position
    length = z - spec.base.height
    pole = box(0.04, 0.04, length).at((x - 0.06, y, z - length / 2))
    head = box(0.05, 0.16, 0.05).at((x - 0.03, y, z), (0, 0.14, 0))
    return [Part(pole, GREY), Part(head, BLACK)]


def _laser(spec: RobotSpec) -> list[Part]:
    mount = spec.laser.base_from_laser
    if spec.laser.height < spec.base.height:
        # Several that look out of the hull.
        ends = [(end * spec.base.length / 2, 0, spec.laser.height) for end in (-1, 1)]
        return [Part(cylinder(0.045, 0.08).at(at), BLACK) for at in ends]
    at = (mount.x, mount.y, spec.laser.height)
    foot = box(0.1, 0.1, 0.04).at((mount.x, mount.y, spec.base.height + 0.0))
    return [Part(cylinder(0.045, 0.08).at(at), BLACK), Part(foot, GREY)]


def wheel_meshes(spec: RobotSpec) -> tuple[Mesh, ...]:
    """One wheel around the origin, its axle along y."""
    radius, wide = spec.base.wheel_radius, 0.057
    along_y = (math.pi / 2, 0.0, 0.0)
    edge = [(radius * 0.6, wide), (radius * 0.92, wide), (radius * 0.97, wide * 0.6)]
    tyre = lathe([(r, -y) for r, y in edge] + edge[::-1], 20)
    parts = [Part(tyre.at(rpy=along_y), RUBBER)]
    parts.append(Part(cylinder(radius * 0.58, wide * 2.08).at(rpy=along_y), GREY))
    for index in range(14):
        angle = index * math.tau / 14
        at = (radius * 0.97 * math.sin(angle), 0.0, radius * 0.97 * math.cos(angle))
        parts.append(Part(box(0.025, wide * 2, 0.02).at(at, (0, angle, 0)), RUBBER))
    return assemble("wheel", parts, ()).meshes
