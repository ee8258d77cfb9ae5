"""What a camera sees apart from robots: floor, sun, objects and their shadows."""

from __future__ import annotations

import numpy as np
import sapien
from sapien import render

from schemas.geometry import Pose3
from sim.assets.asset import Asset
from sim.assets.library import make_asset
from sim.rendering.bodies import entity, material, mesh_shape, render_body
from sim.rendering.ground import Covering, floor_mesh, ground_covering
from sim.rendering.shadow import shadow_brightness, shadow_mesh, toward_sun
from sim.scenes.model import Ground, PlacedObject, Sun


class Stage:
    """Floor and light of one scene; objects can be put on it and taken off again.

    The scene must have a `RenderSystem`: SAPIEN ends the process when a render body is added to a
    scene without one.
    """

    def __init__(self, scene: sapien.Scene, floor: Ground | Covering, sun: Sun) -> None:
        self._scene = scene
        self._sun = sun
        self._floor = floor if isinstance(floor, Covering) else ground_covering(floor)
        self._shade = self._shaded(self._floor)
        self._entities: list[sapien.Entity] = []
        self._light(sun)
        self._add(entity(render_body([floor_mesh(self._floor)])))

    def _light(self, sun: Sun) -> None:
        self._scene.set_ambient_light([sun.ambient] * 3)
        light = render.RenderDirectionalLightComponent()
        light.set_color(sun.color)
        light.shadow = False
        shining = entity(light)
        shining.set_pose(_pose_along(-toward_sun(sun)))
        self._add(shining)

    def put(self, placed: PlacedObject) -> int:
        """Show an object and its shadow; returns its number in the segmentation picture."""
        asset = make_asset(placed.label, placed.look)
        level = placed.world_from_object.lifted()
        pose = Pose3((*level.position[:2], placed.height), level.wxyz)
        number = self.show(asset, pose, placed.scale)
        mesh = shadow_mesh(asset, pose, placed.scale, self._sun, self._floor)
        self._cast(mesh_shape(mesh, self._shade))
        return number

    def show(self, asset: Asset, world_from_asset: Pose3, scale: float = 1.0) -> int:
        """Show an asset without a shadow; returns its number in the segmentation picture."""
        shown = entity(render_body(asset.meshes, scale))
        shown.set_pose(sapien.Pose(list(world_from_asset.position), list(world_from_asset.wxyz)))
        self._add(shown)
        return shown.per_scene_id

    def shade(
        self,
        asset: Asset,
        world_from_asset: Pose3,
        covering: Covering | None = None,
        height: float = 0.0,
    ) -> None:
        """Show an asset's shadow on the floor, or on another covering at a height [m]."""
        on = covering or self._floor
        mesh = shadow_mesh(asset, world_from_asset, 1.0, self._sun, on, height)
        self._cast(mesh_shape(mesh, self._shade if covering is None else self._shaded(on)))

    def _shaded(self, covering: Covering) -> render.RenderMaterial:
        return material(covering.texture, 1.0, shadow_brightness(self._sun))

    def _cast(self, shape: render.RenderShapeTriangleMesh) -> None:
        shadow = render.RenderBodyComponent()
        shadow.attach(shape)
        self._add(entity(shadow))

    def _add(self, made: sapien.Entity) -> None:
        made.add_to_scene(self._scene)
        self._entities.append(made)

    def strike(self) -> None:
        """Take everything off the scene, floor and sun included."""
        for made in self._entities:
            made.remove_from_scene()
        self._entities.clear()


def _pose_along(direction: np.ndarray) -> sapien.Pose:
    """A pose whose x axis is the direction; a directional light shines along it."""
    x, y, z = (float(value) for value in direction)
    yaw, pitch = np.arctan2(y, x), np.arctan2(-z, np.hypot(x, y))
    about_z = sapien.Pose(q=[np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)])
    return about_z * sapien.Pose(q=[np.cos(pitch / 2), 0, np.sin(pitch / 2), 0])
