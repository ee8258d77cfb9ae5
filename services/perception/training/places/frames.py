"""Pictures of rooms, rendered and labelled, written to disk and read again.

On disk a data set is a folder with `frames/000000.jpg ...`, each the K windows of one picture side
by side (120 rows, RGB), and `shards/*.npz`, each with `here` (F,) and `ahead` (F, K): ids of types
in the order of `sim.scenes.rooms.ROOM_KINDS`, -1 for doorways and where nothing is known.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from robots.wheelchair.spec import WHEELCHAIR
from schemas.arrays import Floats, Ints
from schemas.geometry import Pose2, Pose3
from services.perception.places.windows import points_ahead, window_pictures, window_width
from services.perception.space.rays import camera_rays, depth_metres
from services.perception.training.pictures import read_picture, shards_in
from sim.scenes.rooms import ROOM_KINDS, Suite
from sim.scenes.rooms_furnished import furnished_suite
from sim.scenes.rooms_views import raised_mount, random_pose, tilted

_views = 4
"""Pictures of each suite."""
_suites = 16
"""Suites in a shard: every kind of room twice."""
_spec = WHEELCHAIR.camera


@dataclass(frozen=True)
class PlacePicture:
    """The windows of one picture and what they show."""

    windows: NDArray[np.uint8]
    """(K, 120, 160, 3) RGB."""
    here: int
    """Type of the place that the robot is in, -1 in a doorway."""
    ahead: Ints
    """(K,) types of the places that the windows' points lie in, -1 for none."""


class PlaceRenderer:
    """Renders random suites one after another in one SAPIEN scene."""

    def __init__(self) -> None:
        # sapien, and with it the driver that it draws with, is needed by those alone who render.
        from sim.rendering.rooms import RoomStudio  # noqa: PLC0415

        self._studio = RoomStudio(_spec)

    def pictures(self, seed: int, number: int) -> list[PlacePicture]:
        """The pictures of one suite of a seed; the same arrays on every call."""
        rng = np.random.default_rng([seed, number])
        suite = furnished_suite(rng, ROOM_KINDS[number % len(ROOM_KINDS)])
        with self._studio.showing(suite, rng):
            return [self._picture(rng, suite, random_pose(rng, suite)) for _ in range(_views)]

    def _picture(self, rng: np.random.Generator, suite: Suite, pose: Pose2) -> PlacePicture:
        from sim.sensors import measured_depth  # noqa: PLC0415

        mount = raised_mount(rng, _spec)
        picture = self._studio.camera.picture(tilted(rng, pose) @ mount)
        depth = depth_metres(measured_depth(picture.depth, _spec.range_max, rng))
        points = self._points(depth, mount)
        here = _type_id(suite, np.array([pose.x, pose.y]))
        ahead = [_type_id(suite, point) for point in pose.apply(points)]
        return PlacePicture(window_pictures(picture.color), here, np.array(ahead, np.int32))

    def _points(self, depth: Floats, mount: Pose3) -> Floats:
        return points_ahead(depth, camera_rays(self._studio.camera.intrinsics, mount))


def _type_id(suite: Suite, point: Floats) -> int:
    kind = suite.kind_at(float(point[0]), float(point[1]))
    return -1 if kind is None else ROOM_KINDS.index(kind)


def write_places(
    folder: Path,
    count: int,
    seed: int,
    progress: Callable[[int, int], None] = lambda done, count: None,
) -> None:
    """Write at least `count` pictures; shards that are there already are kept.

    `progress` is called after every shard with the pictures done and wanted.
    """
    (folder / "frames").mkdir(parents=True, exist_ok=True)
    (folder / "shards").mkdir(exist_ok=True)
    renderer: PlaceRenderer | None = None
    size = _views * _suites
    for start in range(0, count, size):
        shard = folder / "shards" / f"{start:06d}.npz"
        if not _is_of(shard, seed):
            renderer = renderer or PlaceRenderer()
            suites = range(start // _views, start // _views + _suites)
            _write_shard(folder, shard, start, seed, renderer, suites)
        progress(min(start + size, count), count)


def _is_of(shard: Path, seed: int) -> bool:
    if not shard.exists():
        return False
    with np.load(shard) as arrays:
        return int(arrays["seed"]) == seed


def _write_shard(
    folder: Path, shard: Path, start: int, seed: int, renderer: PlaceRenderer, suites: range
) -> None:
    pictures = [picture for number in suites for picture in renderer.pictures(seed, number)]
    for index, picture in enumerate(pictures, start):
        strip = cv2.cvtColor(np.concatenate(list(picture.windows), axis=1), cv2.COLOR_RGB2BGR)
        name = folder / "frames" / f"{index:06d}.jpg"
        cv2.imwrite(str(name), strip, [cv2.IMWRITE_JPEG_QUALITY, 95])
    partial = shard.with_suffix(".partial.npz")
    here = np.array([picture.here for picture in pictures])
    np.savez(partial, seed=seed, here=here, ahead=np.array([p.ahead for p in pictures]))
    partial.rename(shard)


def read_places(folder: Path) -> list[PlacePicture]:
    """All complete shards of a data set, pictures in memory.

    Raises:
        MissingFramesError: there is no shard, or a picture is missing.
    """
    pictures: list[PlacePicture] = []
    for shard in shards_in(folder):
        with np.load(shard) as arrays:
            for here, ahead in zip(arrays["here"], arrays["ahead"], strict=True):
                windows = _windows(read_picture(folder, len(pictures)))
                pictures.append(PlacePicture(windows, int(here), ahead.astype(np.int32)))
    return pictures


def _windows(strip: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.array(np.split(strip, strip.shape[1] // window_width, axis=1))


def contact_sheet(pictures: list[PlacePicture], path: Path, rows: int = 16) -> None:
    """Write the first pictures below one another with their labels, to look at."""
    strips = [np.concatenate(list(picture.windows), axis=1) for picture in pictures[:rows]]
    sheet = cv2.cvtColor(np.concatenate(strips), cv2.COLOR_RGB2BGR)
    for row, picture in enumerate(pictures[:rows]):
        for column, kind in enumerate([picture.here, *picture.ahead.tolist()]):
            name = "doorway" if kind < 0 else ROOM_KINDS[kind]
            at = (4 + window_width * max(column - 1, 0), 120 * row + (12 if column == 0 else 114))
            cv2.putText(sheet, name, at, cv2.FONT_HERSHEY_SIMPLEX, 0.4, (0, 255, 255), 1)
    cv2.imwrite(str(path), sheet)
