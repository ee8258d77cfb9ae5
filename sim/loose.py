"""Things that can be picked up: dynamic bodies with friction."""

from __future__ import annotations

import sapien
from sapien import physx

from schemas.geometry import Pose3
from sim.assets.library import SMALL, make_asset
from sim.obstacles import collision_shape
from sim.rendering.bodies import entity, render_body
from sim.scenes.model import PlacedObject, World

MASSES: dict[str, float] = {
    "drill": 1.0,
    "banana": 0.15,
    "pitcher": 0.45,
    "cracker box": 0.41,
    "mustard bottle": 0.40,
    "ball": 0.25,
}
"""[kg]"""
FRICTION = 0.8
ROLLING_DAMPING = 2.0
"""Without it a ball on a floor without friction would roll for ever [1/s]."""


class LooseThings:
    """The small things of a world, free to be moved."""

    def __init__(self, scene: sapien.Scene, world: World, visible: bool) -> None:
        rough = scene.create_physical_material(FRICTION, FRICTION, 0.0)
        self._bodies: dict[str, physx.PhysxRigidDynamicComponent] = {}
        for placed in world.objects:
            if placed.label in SMALL:
                self._bodies[placed.id] = _put(scene, placed, rough, visible)

    @property
    def poses(self) -> dict[str, Pose3]:
        """`world_from_thing` by id; the origin is where the thing's underside was."""
        return {name: _pose(body) for name, body in self._bodies.items()}

    def place(self, poses: dict[str, Pose3]) -> None:
        """Put things somewhere, at rest."""
        for name, pose in poses.items():
            body = self._bodies[name]
            body.entity.set_pose(sapien.Pose(list(pose.position), list(pose.wxyz)))
            body.set_linear_velocity([0.0, 0.0, 0.0])
            body.set_angular_velocity([0.0, 0.0, 0.0])

    def take_away(self, name: str) -> None:
        """Let a thing vanish, as if somebody took it."""
        self._bodies.pop(name).entity.remove_from_scene()


def _put(
    scene: sapien.Scene, placed: PlacedObject, material: physx.PhysxMaterial, visible: bool
) -> physx.PhysxRigidDynamicComponent:
    asset = make_asset(placed.label, placed.look)
    body = physx.PhysxRigidDynamicComponent()
    for shape in asset.collisions:
        body.attach(collision_shape(shape, placed.scale, material))
    body.set_mass(MASSES[placed.label])
    body.set_angular_damping(ROLLING_DAMPING)
    thing = entity(body)
    if visible:
        thing.add_component(render_body(asset.meshes, placed.scale))
    thing.name = placed.id
    pose = placed.world_from_object.lifted()
    at = [*pose.position[:2], placed.height]
    thing.set_pose(sapien.Pose(at, list(pose.wxyz)))
    thing.add_to_scene(scene)
    return body


def _pose(body: physx.PhysxRigidDynamicComponent) -> Pose3:
    x, y, z = (float(value) for value in body.entity.pose.p)
    w, qx, qy, qz = (float(value) for value in body.entity.pose.q)
    return Pose3((x, y, z), (w, qx, qy, qz))
