"""Where rendered tags of 0.3 m are said to hang, seen by the wheelchair's camera, beside the truth.

At each range and viewing angle the tag hangs turned and moved at random a little, under random
light, in a picture with the noise of a camera.
"""

import math
from collections.abc import Iterator

import numpy as np
import sapien
from numpy.typing import NDArray
from sapien import render

from robots.wheelchair.spec import WHEELCHAIR
from schemas.geometry import Pose2, Pose3
from schemas.sensing import RgbdFrame
from services.perception.fiducials import TagReader, fiducials_in
from sim.assets.tag import make_tag
from sim.rendering.bodies import entity, render_body
from sim.rendering.camera import Camera
from tests.benchmarks.rows import Row, quantile, quantile_interval
from tests.benchmarks.timing import interleaved

SIDE = 0.3
RANGES = (1.0, 2.0, 4.0)
"""[m]"""
ANGLES = (0, 30, 60)
"""Between the tag's normal and the line to the camera [degrees]."""

_spec = WHEELCHAIR.camera
_noise = 4.0
"""Deviation of a pixel's value, of 255."""
_worst = {1.0: 0.02, 2.0: 0.05, 4.0: 0.15}
"""Median position errors that would be too much [m]."""


class _Gallery:
    """A camera and one tag before it."""

    def __init__(self) -> None:
        self._scene = sapien.Scene([render.RenderSystem()])
        self._camera = Camera(self._scene, _spec.width, _spec.height, _spec.horizontal_fov)
        self._tag = entity(render_body(make_tag(7, SIDE).meshes))
        self._tag.add_to_scene(self._scene)

    def frame(self, base_from_tag: Pose3, rng: np.random.Generator) -> RgbdFrame:
        self._scene.set_ambient_light([rng.uniform(0.5, 1.0)] * 3)
        self._tag.set_pose(sapien.Pose(list(base_from_tag.position), list(base_from_tag.wxyz)))
        color = self._camera.picture(_spec.base_from_camera).color
        noisy = np.clip(color + rng.normal(0, _noise, color.shape), 0, 255).astype(np.uint8)
        return RgbdFrame(
            stamp_ns=0,
            color=noisy,
            depth_mm=np.zeros(color.shape[:2], np.uint16),
            intrinsics=self._camera.intrinsics,
            base_from_camera=_spec.base_from_camera,
            odom_from_base=Pose2(0.0, 0.0, 0.0),
        )


def measure(rounds: int) -> list[Row]:
    """Needs a Vulkan device."""
    gallery, reader, rng = _Gallery(), TagReader(), np.random.default_rng(0)
    rows = [
        row
        for distance in RANGES
        for angle in ANGLES
        for row in _rows(
            distance, angle, list(_looks(gallery, reader, rng, distance, angle, rounds))
        )
    ]
    frame = gallery.frame(_hung(rng, 2.0, 30), rng)
    spent = interleaved({"ours": lambda: fiducials_in(frame, reader, SIDE)}, rounds)["ours"]
    return [*rows, _row("tags in 960x240", "time", "ms", 1e3 * spent)]


def _looks(
    gallery: _Gallery,
    reader: TagReader,
    rng: np.random.Generator,
    distance: float,
    angle: int,
    rounds: int,
) -> Iterator[tuple[float, float, float] | None]:
    """Position error [m], angle error [degrees] and normalised square error; None if not read."""
    for _ in range(rounds):
        hung = _hung(rng, distance, angle)
        found = fiducials_in(gallery.frame(hung, rng), reader, SIDE)
        if found.ids.tolist() != [7]:
            yield None
            continue
        error = found.positions_base[0] - hung.position
        square = float(error @ np.linalg.solve(found.covariances[0, :3, :3], error))
        w, x, y, z = found.wxyz_base[0].tolist()
        out = Pose3((0.0, 0.0, 0.0), (w, x, y, z)).rotation()[:, 2]
        lean = math.acos(float(np.clip(out @ hung.rotation()[:, 0], -1, 1)))
        yield float(np.linalg.norm(error)), math.degrees(lean), square


def _hung(rng: np.random.Generator, distance: float, angle: int) -> Pose3:
    """`base_from_plate` of a tag that is seen at an angle from a distance."""
    mount = _spec.base_from_camera.position
    bearing = rng.uniform(-0.6, 0.6)
    turn = math.radians(angle) * (1 if rng.random() < 0.5 else -1)
    yaw = bearing + math.pi + turn + rng.normal(0, 0.03)
    x = mount[0] + distance * math.cos(bearing)
    y = mount[1] + distance * math.sin(bearing)
    z = mount[2] + rng.uniform(-0.1, 0.1) * distance
    half = yaw / 2
    return Pose3((x, y, z), (math.cos(half), 0.0, 0.0, math.sin(half)))


def _rows(distance: float, angle: int, looks: list[tuple[float, float, float] | None]) -> list[Row]:
    name = f"tag at {distance:g} m, {angle} degrees"
    read = [look for look in looks if look is not None]
    share = len(read) / len(looks)
    rows = [_row(name, "read", "1", np.array([share]), better="higher")]
    if not read:
        return rows
    position, lean, square = np.array(read).T
    return [
        *rows,
        _row(name, "position error", "cm", 100 * position, limit=100 * _worst[distance]),
        _row(name, "angle error", "degrees", lean),
        _row(
            name,
            "mean normalised squared position error (3 is right)",
            "1",
            np.array([square.mean()]),
        ),
    ]


def _row(
    row: str,
    metric: str,
    unit: str,
    samples: NDArray[np.float64],
    limit: float | None = None,
    better: str = "lower",
) -> Row:
    return Row(
        row=row,
        metric=metric,
        unit=unit,
        better="higher" if better == "higher" else "lower",
        ours=quantile(samples),
        interval=quantile_interval(samples),
        limit=limit,
    )
