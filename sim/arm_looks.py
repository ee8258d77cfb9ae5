"""How the arm looks: bare metal tubes, joints with blue caps, a dark gripper with rubber pads."""

from __future__ import annotations

import math

import numpy as np

from robots.arm import ArmSpec, LinkShape, finger_boxes, hand_boxes
from sim.assets.asset import Mesh, Part, assemble
from sim.assets.shapes import rounded_box
from sim.assets.surface import Floats, Surface, box, cylinder, lathe
from sim.assets.texture import Color

METAL: Color = (0.72, 0.73, 0.75)
BLUE: Color = (0.36, 0.56, 0.72)
DARK: Color = (0.13, 0.13, 0.14)
RUBBER: Color = (0.22, 0.22, 0.23)
GLASS: Color = (0.05, 0.06, 0.10)


def foot_meshes(arm: ArmSpec) -> tuple[Mesh, ...]:
    """The flange that the arm stands on, in the frame of the base."""
    at = arm.base_from_foot.position
    plate = Part(box(0.24, 0.24, 0.02).at(np.subtract(at, (0, 0, 0.01))), DARK)
    foot = Part(cylinder(0.075, 0.05, 24).at(np.add(at, (0, 0, 0.025))), METAL, roughness=0.4)
    return assemble("arm foot", [plate, foot], ()).meshes


def link_meshes(arm: ArmSpec, link: int) -> tuple[Mesh, ...]:
    """One link in its own frame; the last carries the gripper's and the camera's housing."""
    parts: list[Part] = []
    for shape in arm.shapes:
        if shape.link == link:
            parts += _tube(shape)
    parts += _joint(link)
    if link == 6:
        parts += _hand(arm)
    return assemble("arm link", parts, ()).meshes


def _tube(shape: LinkShape) -> list[Part]:
    """A round body with domed ends."""
    start, end = np.array(shape.start), np.array(shape.end)
    length, radius = float(np.linalg.norm(end - start)), shape.radius * 0.94
    dome = np.linspace(0, math.pi / 2, 6)
    profile = [(radius * math.cos(a), -length / 2 - radius * math.sin(a)) for a in dome[::-1]]
    profile += [(radius * math.cos(a), length / 2 + radius * math.sin(a)) for a in dome]
    body = _along(lathe([(max(r, 1e-4), z) for r, z in profile], 24), end - start)
    parts = [Part(body.at((start + end) / 2), METAL, roughness=0.4)]
    if length < 0.2:
        return parts
    # Long tubes are thinner between their joints; rings mark where one ends and the other begins.
    for point, sign in ((start, 1), (end, -1)):
        ring = _along(cylinder(shape.radius, 0.02, 24), end - start)
        at = point + sign * 0.09 * (end - start) / length
        parts.append(Part(ring.at(at), DARK))
    return parts


def _joint(link: int) -> list[Part]:
    """Housings of the joints at both ends of the long links, with blue caps."""
    if link == 2:
        return [*_drum((0.425, 0, 0.136), 0.062, 0.13), *_drum((0, 0, 0.136), 0.056, 0.12)]
    if link == 3:
        return [*_drum((0.39225, 0, 0.016), 0.052, 0.11), *_drum((0, 0, 0.03), 0.046, 0.11)]
    return []


def _drum(at: tuple[float, float, float], radius: float, length: float) -> list[Part]:
    """A short cylinder along the joint's axis, its outer end capped in blue."""
    housing = cylinder(radius, length, 24).at(at)
    cap = cylinder(radius * 0.9, 0.012, 24).at(np.add(at, (0, 0, length / 2 + 0.004)))
    return [Part(housing, METAL, roughness=0.4), Part(cap, BLUE, roughness=0.5)]


def _hand(arm: ArmSpec) -> list[Part]:
    """Housing with the rail that the fingers slide along, and the camera beside it."""
    palm, camera = hand_boxes(arm)
    x, y, z = palm.size
    body = rounded_box(x, y * 0.7, z * 0.85, 0.02).at((0, 0, z * 0.42))
    rail = box(x * 0.55, y * 1.2, z * 0.22).at((0, 0, z * 0.88))
    cx, cy, cz = camera.center
    housing = rounded_box(*camera.size, 0.008).at(camera.center)
    strut = box(abs(cx), 0.03, 0.012).at((cx / 2, 0, cz * 0.6))
    lenses = [
        cylinder(0.008, 0.004, 12).at((cx, cy + side, cz + camera.size[2] / 2))
        for side in (-0.025, 0.0, 0.025)
    ]
    return [
        Part(body, DARK, roughness=0.6),
        Part(rail, METAL, roughness=0.4),
        Part(housing, METAL, roughness=0.5),
        Part(strut, DARK),
        *(Part(lens, GLASS, roughness=0.3) for lens in lenses),
    ]


def finger_meshes(arm: ArmSpec, finger: int) -> tuple[Mesh, ...]:
    """One finger of a closed gripper, in the flange's frame."""
    shape = finger_boxes(arm.gripper, 0.0)[finger]
    x, y, z = shape.size
    inwards = -math.copysign(1.0, shape.center[1])
    back = box(x, y * 0.6, z).at(np.add(shape.center, (0, -inwards * y * 0.2, 0)))
    pad = box(x * 0.96, y * 0.38, z * 0.55).at(
        np.add(shape.center, (0, inwards * y * 0.3, z * 0.22))
    )
    return assemble("finger", [Part(back, METAL, roughness=0.4), Part(pad, RUBBER)], ()).meshes


def _along(surface: Surface, direction: Floats) -> Surface:
    """A surface about z turned so that it lies along a direction (3,)."""
    x, y, z = (direction / np.linalg.norm(direction)).tolist()
    return surface.at(rpy=(0.0, math.acos(np.clip(z, -1, 1)), math.atan2(y, x)))
