"""The files of one scene of a set: pictures, and the truth in space beside them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from schemas.geometry import Pose3
from schemas.sensing import Intrinsics
from sim.annotation import TrueFrame
from sim.scenes.training_parts import get_part
from sim.scenes.training_views import FRAMES_PER_SCENE
from sim.shards import RECIPE, renderer

RANGE_MAX = 7.0
"""Of the depth sensor: that of the robots outdoors [m]."""
_depth_stream = 7
# What the pictures of `sim.dataset` are written with.
_jpeg = [
    cv2.IMWRITE_JPEG_QUALITY, 95,
    cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
]  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """The pictures of one scene of a set."""

    folder: Path
    part: str
    seed: int
    number: int

    @property
    def truth(self) -> Path:
        """The file of all but the pictures."""
        return self.folder / "truth" / f"{self.number:06d}.npz"

    def picture(self, view: int) -> Path:
        """The file of one picture."""
        return self.folder / "frames" / f"{FRAMES_PER_SCENE * self.number + view:06d}.jpg"

    def is_complete(self) -> bool:
        """Whether it has been written as it would be written now."""
        if not self.truth.exists():
            return False
        with np.load(self.truth) as arrays:
            return int(arrays["recipe"]) == RECIPE

    def color(self, view: int) -> NDArray[np.uint8]:
        """One picture, RGB (H, W, 3)."""
        picture = cv2.imread(str(self.picture(view)), cv2.IMREAD_COLOR_RGB)
        return np.asarray(picture, np.uint8)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """All but the pictures; objects of the views one after another, `count` of each."""
        with np.load(self.truth) as file:
            return {name: file[name] for name in file.files}


def write_scene(scene: Scene) -> None:
    """Render one scene; the truth comes last, and says that the scene is complete.

    `sim.vulkan.activate()` comes before.
    """
    truths = renderer().true_frames(get_part(scene.part), scene.seed, scene.number)
    scene.truth.parent.mkdir(parents=True, exist_ok=True)
    scene.picture(0).parent.mkdir(parents=True, exist_ok=True)
    for view, truth in enumerate(truths):
        bgr = cv2.cvtColor(truth.frame.color, cv2.COLOR_RGB2BGR)
        cv2.imwrite(str(scene.picture(view)), bgr, _jpeg)
    partial = scene.truth.with_suffix(".partial.npz")
    np.savez_compressed(partial, recipe=RECIPE, **_arrays(scene, truths))
    partial.rename(scene.truth)


def _arrays(scene: Scene, truths: list[TrueFrame]) -> dict[str, Any]:
    # They import sapien, and with it the driver, which those alone need who render.
    from services.perception.training.forms.data import level_from  # noqa: PLC0415
    from sim.sensors import measured_depth  # noqa: PLC0415

    stream = get_part(scene.part).stream
    rng = np.random.default_rng([_depth_stream, stream, scene.seed, scene.number])
    mounts = [level_from(truth.world_from_camera) for truth in truths]
    centers = [mount.apply(t.centers) for mount, t in zip(mounts, truths, strict=True)]
    return {
        "depth": np.array([measured_depth(truth.depth, RANGE_MAX, rng) for truth in truths]),
        "intrinsics": np.array([_numbers(truth.intrinsics) for truth in truths]),
        "mounts": np.array([_pose_numbers(mount) for mount in mounts]),
        "count": np.array([len(truth.frame.classes) for truth in truths]),
        "boxes": np.concatenate([truth.frame.boxes for truth in truths]),
        "classes": np.concatenate([truth.frame.classes for truth in truths]),
        "ignored": np.concatenate([truth.frame.ignored for truth in truths]),
        "centers": np.concatenate(centers),
        "sizes": np.concatenate([truth.sizes for truth in truths]),
    }


def _numbers(camera: Intrinsics) -> tuple[float, ...]:
    return camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy


def _pose_numbers(pose: Pose3) -> tuple[float, ...]:
    return *pose.position, *pose.wxyz
