"""Ground, objects and walls of a world as static bodies that robots bump into and beams hit."""

from __future__ import annotations

import math
from collections.abc import Collection

import sapien
from sapien import physx

from sim.assets.asset import CollisionShape
from sim.assets.library import make_asset
from sim.rendering.bodies import entity
from sim.scenes.model import PlacedObject, Wall, World

UPRIGHT = [math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0]
"""PhysX cylinders lie along x."""


def add_obstacles(scene: sapien.Scene, world: World, loose: Collection[str] = ()) -> None:
    """Put the ground, every object's collision shapes and all walls into the scene.

    Objects of the `loose` classes are left out: they are no obstacles that stand fast.
    Nothing has friction: the imposed speeds of the base are then exact without a controller.
    """
    slippery = scene.create_physical_material(0.0, 0.0, 0.0)
    scene.add_ground(0.0, render=False, material=slippery)
    for placed in world.objects:
        if placed.label in loose:
            continue
        body = physx.PhysxRigidStaticComponent()
        for shape in make_asset(placed.label, placed.look).collisions:
            body.attach(collision_shape(shape, placed.scale, slippery))
        standing = entity(body)
        standing.name = placed.id
        standing.set_pose(_pose(placed))
        standing.add_to_scene(scene)
    for wall in world.walls:
        _add_wall(scene, wall, slippery)


def _add_wall(scene: sapien.Scene, wall: Wall, material: physx.PhysxMaterial) -> None:
    (x0, y0), (x1, y1) = wall.start, wall.end
    half_length = math.dist(wall.start, wall.end) / 2
    half_yaw = math.atan2(y1 - y0, x1 - x0) / 2
    body = physx.PhysxRigidStaticComponent()
    half = [half_length, wall.thickness / 2, wall.height / 2]
    body.attach(physx.PhysxCollisionShapeBox(half, material))
    standing = entity(body)
    center = [(x0 + x1) / 2, (y0 + y1) / 2, wall.height / 2]
    standing.set_pose(sapien.Pose(center, [math.cos(half_yaw), 0, 0, math.sin(half_yaw)]))
    standing.add_to_scene(scene)


def _pose(placed: PlacedObject) -> sapien.Pose:
    pose = placed.world_from_object
    half = pose.yaw / 2
    return sapien.Pose([pose.x, pose.y, placed.height], [math.cos(half), 0, 0, math.sin(half)])


def collision_shape(
    shape: CollisionShape, scale: float, material: physx.PhysxMaterial
) -> physx.PhysxCollisionShape:
    """The shape as PhysX has it, in the frame of its object."""
    center = [scale * value for value in shape.center]
    half = [scale * value for value in shape.half]
    if shape.kind == "box":
        made: physx.PhysxCollisionShape = physx.PhysxCollisionShapeBox(half, material)
        made.set_local_pose(sapien.Pose(center))
        return made
    if shape.kind == "ball":
        made = physx.PhysxCollisionShapeSphere(half[0], material)
        made.set_local_pose(sapien.Pose(center))
        return made
    made = physx.PhysxCollisionShapeCylinder(half[0], half[2], material)
    made.set_local_pose(sapien.Pose(center, UPRIGHT))
    return made
