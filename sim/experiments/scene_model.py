"""Recognition of kinds of places as a model: reads the ground truth and reports it as a classifier.

The robot recognises the place that it stands in, and one patch of every place that it sees ahead,
through doors. Nearer patches are recognised better. What a place is taken for stays the same until
the robot has moved some way: another look from the same spot is no new evidence.
"""

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.random import Generator

from robots.spec import CameraSpec
from schemas.arrays import Floats
from schemas.geometry import Pose2
from schemas.perception import SceneObservation
from schemas.sensing import Odometry
from sim.experiments.sight import Walls
from sim.oracle import outline_of_region
from sim.scenes.model import World

_alike = (
    ("kitchen", "cafeteria", "lounge"),
    ("office", "lab", "conference room"),
    ("hallway", "elevator", "lounge"),
)
"""Types of places that are taken for one another more often than for others."""
_alike_share = 0.8
"""Of the mistakes are among them."""
_spacing = 0.4
"""Of the floor points that are looked for [m]."""
_off_the_wall = 0.2
"""Floor nearer to a wall does not count as seen [m]."""


@dataclass(frozen=True)
class SceneSettings:
    """How good the modelled recognition of places is."""

    rate_hz: float = 2.0
    accuracy_near: float = 0.85
    """Probability that the true type of the place around the robot looks best."""
    accuracy_far: float = 0.65
    """The same at the end of the camera's range; linear in between."""
    least_floor_m2: float = 0.6
    """Of a place's floor must be in view for it to be recognised from outside."""
    hold_m: float = 1.0
    """Way after which a look at the same place is an independent one."""

    @property
    def summary(self) -> str:
        """One line for people."""
        return (
            f"places recognised at {self.rate_hz:g} Hz: right {self.accuracy_near:g} of the time "
            f"inside to {self.accuracy_far:g} at the end of the range, {_alike_share:g} of the "
            f"mistakes among alike types, the same mistake for {self.hold_m:g} m, "
            f"{self.least_floor_m2:g} m2 of floor needed, occlusion by walls"
        )


@dataclass
class _Look:
    """What a place was last taken for, and from where."""

    seen_from: tuple[float, float]
    taken_for: int
    accuracy: float


class SceneModel:
    """Says what kinds of places the robot would recognise.

    Args:
        world: the ground truth.
        locations: types of places that the robot has words for.
        camera: its range and angle are the field of view.
        settings: errors.
        rng: the only source of randomness.
    """

    def __init__(
        self,
        world: World,
        locations: tuple[str, ...],
        camera: CameraSpec,
        settings: SceneSettings,
        rng: Generator,
    ) -> None:
        self._types = tuple(name for name in locations if name != "generic")
        self._regions = [region for region in world.regions if region.kind in self._types]
        self._floors = [_floor_points(outline_of_region(region)) for region in self._regions]
        self._walls = Walls(world.walls)
        self._camera, self._settings, self._rng = camera, settings, rng
        self._looks: dict[int, _Look] = {}
        self._due_ns = 0

    def observe(self, world_from_base: Pose2, odometry: Odometry) -> SceneObservation | None:
        """What a picture taken now would say about places; None when none is due."""
        if not self._regions or odometry.stamp_ns < self._due_ns:
            return None
        self._due_ns = odometry.stamp_ns + round(1e9 / self._settings.rate_hz)
        patches = self._patches(world_from_base)
        looks = [self._look(number, patch, world_from_base) for number, patch in patches.items()]
        rows = [self._posterior(look) for look in looks]
        return SceneObservation(
            stamp_ns=odometry.stamp_ns,
            types=self._types,
            odom_from_base=odometry.odom_from_base,
            points_base=np.array(list(patches.values())).reshape(-1, 2),
            probabilities=np.array(rows).reshape(-1, len(self._types)),
        )

    def _patches(self, world_from_base: Pose2) -> dict[int, Floats]:
        """One point (2,) in the base frame for every region in view, (0, 0) for the robot's own."""
        here = shapely.Point(world_from_base.x, world_from_base.y)
        found: dict[int, Floats] = {}
        for number, region in enumerate(self._regions):
            if outline_of_region(region).intersects(here):
                found[number] = np.zeros(2)
                continue
            seen = self._seen_floor(world_from_base, self._floors[number])
            if len(seen) * _spacing**2 >= self._settings.least_floor_m2:
                found[number] = _central(seen)
        return found

    def _seen_floor(self, world_from_base: Pose2, floor: Floats) -> Floats:
        points = world_from_base.inverse().apply(floor)
        bearing = np.arctan2(points[:, 1], points[:, 0])
        in_view = np.hypot(*points.T) < self._camera.range_max
        in_view &= np.abs(bearing) < self._camera.horizontal_fov / 2
        points = points[in_view]
        return points[self._walls.in_sight(world_from_base, points)]

    def _look(self, number: int, patch: Floats, world_from_base: Pose2) -> _Look:
        """The last look at a region if it was from about here, else a new one."""
        here = (world_from_base.x, world_from_base.y)
        last = self._looks.get(number)
        if last and np.hypot(here[0] - last.seen_from[0], here[1] - last.seen_from[1]) < (
            self._settings.hold_m
        ):
            return last
        share = float(np.hypot(*patch)) / self._camera.range_max
        near, far = self._settings.accuracy_near, self._settings.accuracy_far
        accuracy = near + (far - near) * share
        truth = self._types.index(self._regions[number].kind)
        chances = confusion(self._types, accuracy)[truth]
        taken_for = int(self._rng.choice(len(self._types), p=chances))
        self._looks[number] = _Look(here, taken_for, accuracy)
        return self._looks[number]

    def _posterior(self, look: _Look) -> Floats:
        """P(type | what it looks like) (T,) under even odds: calibrated by construction."""
        column = confusion(self._types, look.accuracy)[:, look.taken_for]
        return column / column.sum()


def confusion(types: tuple[str, ...], accuracy: float) -> Floats:
    """P(looks like column | is row), (T, T)."""
    count = len(types)
    alike = np.zeros((count, count))
    for group in _alike:
        members = [types.index(name) for name in group if name in types]
        alike[np.ix_(members, members)] = 1.0
    np.fill_diagonal(alike, 0.0)
    others = 1.0 - np.eye(count)
    share = np.where(alike.any(axis=1, keepdims=True), _alike_share, 0.0)
    mistakes = share * _rows_to_one(alike) + (1 - share) * _rows_to_one(others)
    return accuracy * np.eye(count) + (1 - accuracy) * mistakes


def _rows_to_one(table: Floats) -> Floats:
    return table / np.maximum(table.sum(axis=1, keepdims=True), 1e-12)


def _floor_points(outline: shapely.Polygon) -> Floats:
    """Points (F, 2) spread over a floor."""
    x0, y0, x1, y1 = outline.bounds
    axes = (np.arange(x0 + _spacing / 2, x1, _spacing), np.arange(y0 + _spacing / 2, y1, _spacing))
    points = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    inner = outline.buffer(-_off_the_wall)
    return points[shapely.contains_xy(inner, points[:, 0], points[:, 1])]


def _central(points: Floats) -> Floats:
    """The one of the points (N, 2) nearest to their mean, which may lie behind a corner."""
    return points[int(np.argmin(np.hypot(*(points - points.mean(axis=0)).T)))]
