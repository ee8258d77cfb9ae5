"""Our camera's shader beside SAPIEN's default one, in one scene.

On a CPU the default one takes a quarter of a minute to its first picture, so this benchmark is
run by hand and not by the tests.
"""

import math

import numpy as np
import sapien
from sapien import physx, render

from robots.husky.spec import HUSKY
from schemas.geometry import Pose3
from sim.rendering.camera import FAR, LEVEL_FROM_OPTICAL, NEAR, Camera
from sim.rendering.stage import Stage
from sim.world import make_world
from tests.benchmarks.rows import Row, Samples, compared
from tests.benchmarks.timing import Call, interleaved, seconds

PEER = "SAPIEN's default shader"

_textures = ("Color", "Position", "Segmentation")
_drift = 3.0


def measure(rounds: int) -> list[Row]:
    """Needs a Vulkan device."""
    world = make_world("hydrant", 0)
    scene = sapien.Scene([physx.PhysxCpuSystem(), render.RenderSystem()])
    stage = Stage(scene, world.ground, world.sun)
    for placed in world.objects:
        stage.put(placed)
    pose = world.world_from_start.lifted() @ HUSKY.camera.base_from_camera
    spec = HUSKY.camera
    camera = Camera(scene, spec.width, spec.height, spec.horizontal_fov)
    calls: dict[str, Call] = {
        "ours": lambda: camera.picture(pose),
        PEER: _default_camera(scene, pose),
    }
    first = {name: np.array([seconds(call)]) for name, call in calls.items()}
    later = interleaved(calls, rounds)
    return [_row("first picture", "s", first), _row("later pictures", "ms", later, 1e3)]


def _row(metric: str, unit: str, spent: dict[str, Samples], scale: float = 1.0) -> Row:
    ours, theirs = scale * spent["ours"], scale * spent[PEER]
    return compared("camera 320x240", metric, unit, ours, (PEER, theirs), drift=_drift)


def _default_camera(scene: sapien.Scene, world_from_camera: Pose3) -> Call:
    """Takes and fetches what ours fetches, without sky and without conversion."""
    spec = HUSKY.camera
    camera = render.RenderCameraComponent(spec.width, spec.height, render.get_camera_shader_dir())
    camera.set_fovy(2 * math.atan(math.tan(spec.horizontal_fov / 2) * spec.height / spec.width))
    camera.near, camera.far = NEAR, FAR
    entity = sapien.Entity()
    entity.add_component(camera)
    level = world_from_camera @ LEVEL_FROM_OPTICAL.inverse()
    entity.set_pose(sapien.Pose(list(level.position), list(level.wxyz)))
    entity.add_to_scene(scene)

    def take() -> None:
        scene.update_render()
        camera.take_picture()
        for texture in _textures:
            camera.get_picture(texture)

    return take
