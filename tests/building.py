"""Rooms and hallways as polygons, and a robot that walks through them: for tests of mapping."""

import math
from dataclasses import dataclass, field

import numpy as np
import shapely

from robots.husky.spec import HUSKY
from robots.symbols import SYMBOL_SPACES, SymbolSpace
from schemas.geometry import Pose2
from schemas.perception import Detections, SceneObservation
from schemas.sensing import LaserScan
from services.mapping.annotations import Reading
from services.mapping.filter import SemanticFilter
from services.mapping.odometer import OdometryNoise

WHEELCHAIR = SYMBOL_SPACES["wheelchair"]
CLASSES = WHEELCHAIR.object_classes + WHEELCHAIR.locations
TYPES = tuple(name for name in WHEELCHAIR.locations if name != "generic")
SIGHT, HALF_VIEW = 8.0, math.radians(60)
_beams, _reach = 180, 8.0
_step_ns = 200_000_000

Box = tuple[float, float, float, float]


@dataclass
class Building:
    """Places (type, box), doors between them, and the robot.

    The classifier is right with `accuracy`, of the place the robot stands in and of one patch of
    each place that it looks into.
    """

    rooms: list[tuple[str, Box]]
    doors: list[Box]
    start: tuple[float, float]
    accuracy: float = 0.9
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(3))
    time_ns: int = 0

    def __post_init__(self) -> None:
        boxes = [shapely.box(*box) for _, box in self.rooms]
        self.floor = shapely.union_all([*boxes, *(shapely.box(*box) for box in self.doors)])
        self.places = boxes
        self.pose = Pose2(*self.start, 0.0)
        self.origin = self.pose

    def room(self, point: np.ndarray) -> str:
        """Type of the place at (2,) in the map frame."""
        x, y = (np.asarray(point) + self.start).tolist()
        inside = [name for name, (x0, y0, x1, y1) in self.rooms if x0 < x < x1 and y0 < y < y1]
        return inside[0] if inside else ""

    def filter(
        self, particles: int = 100, seed: int = 0, symbols: SymbolSpace = WHEELCHAIR
    ) -> SemanticFilter:
        return SemanticFilter(symbols, HUSKY.camera, particles, np.random.default_rng(seed))

    def walk(self, semantic: SemanticFilter, *way: tuple[float, float], looks: bool = True) -> None:
        """Go along a polyline; all sensors report every 0.2 m."""
        for goal in way:
            while (gap := math.hypot(goal[0] - self.pose.x, goal[1] - self.pose.y)) > 1e-6:
                heading = math.atan2(goal[1] - self.pose.y, goal[0] - self.pose.x)
                step = min(0.2, gap)
                x, y = (
                    self.pose.x + step * math.cos(heading),
                    self.pose.y + step * math.sin(heading),
                )
                self.pose = Pose2(x, y, heading)
                self.sense(semantic, looks)

    def sense(self, semantic: SemanticFilter, looks: bool = True) -> None:
        self.time_ns += _step_ns
        semantic.move(self.odometry, OdometryNoise(1e-5, 1e-5))
        semantic.scan(self.scan())
        if looks:
            semantic.glance(self.scene())
        semantic.observe(self.nothing_detected())

    @property
    def odometry(self) -> Pose2:
        return self.origin.inverse() @ self.pose

    def scan(self) -> LaserScan:
        angles = -math.pi + 2 * math.pi / _beams * np.arange(_beams)
        ranges = self._ranges(angles + self.pose.yaw)
        return LaserScan(
            stamp_ns=self.time_ns,
            angle_min=-math.pi,
            angle_increment=2 * math.pi / _beams,
            range_max=_reach,
            ranges=ranges.astype(np.float32),
            base_from_laser=Pose2(0.0, 0.0, 0.0),
            odom_from_base=self.odometry,
        )

    def scene(self) -> SceneObservation:
        points, names = [np.zeros(2)], [self.rooms[self._standing()][0]]
        for index, place in enumerate(self.places):
            patch = self._patch(place) if index != self._standing() else None
            if patch is not None:
                points.append(patch)
                names.append(self.rooms[index][0])
        return SceneObservation(
            stamp_ns=self.time_ns,
            types=TYPES,
            odom_from_base=self.odometry,
            points_base=np.array(points),
            probabilities=np.array([self._classified(name) for name in names]),
        )

    def nothing_detected(self) -> Detections:
        bearings = np.linspace(-HALF_VIEW, HALF_VIEW, 31)
        return Detections(
            stamp_ns=self.time_ns,
            classes=("cone",),
            odom_from_base=self.odometry,
            boxes_px=np.zeros((0, 4)),
            probabilities=np.zeros((0, 1)),
            scores=np.zeros(0),
            centers_base=np.zeros((0, 3)),
            covariances=np.zeros((0, 3, 3)),
            extents=np.zeros((0, 3)),
            view_bearings=bearings,
            view_ranges=np.minimum(self._ranges(bearings + self.pose.yaw), SIGHT),
            view_near=0.5,
            picture_size=(320, 240),
            inference_ms=0.0,
        )

    def _standing(self) -> int:
        here = shapely.Point(self.pose.x, self.pose.y)
        return int(np.argmin([place.distance(here) for place in self.places]))

    def _ranges(self, angles: np.ndarray) -> np.ndarray:
        here = np.array([self.pose.x, self.pose.y])
        ends = here + _reach * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        rays = shapely.linestrings(np.stack([np.broadcast_to(here, ends.shape), ends], axis=1))
        hits = shapely.intersection(rays, self.floor.boundary)
        return np.nan_to_num(shapely.distance(shapely.Point(here), hits), nan=np.inf)

    def _patch(self, place: shapely.Polygon) -> np.ndarray | None:
        """Middle (2,) in the base frame of what is seen of a place's floor."""
        angles = np.linspace(-HALF_VIEW, HALF_VIEW, 61) + self.pose.yaw
        reach = np.minimum(self._ranges(angles), SIGHT)
        here = np.array([self.pose.x, self.pose.y])
        rim = here + reach[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        seen = shapely.Polygon(np.vstack([here, rim])).buffer(0).intersection(place.buffer(-0.2))
        if seen.area < 0.6:
            return None
        middle = seen.representative_point()
        return self.pose.inverse().apply(np.array([middle.x, middle.y]))

    def _classified(self, name: str) -> np.ndarray:
        best = name if self.rng.random() < self.accuracy else str(self.rng.choice(TYPES))
        rest = (1 - self.accuracy) / (len(TYPES) - 1)
        return np.where(np.array(TYPES) == best, self.accuracy, rest)


def means(name: str) -> Reading:
    """ "Go to the ...": a figure without relation."""
    return Reading(0.0, CLASSES.index(name), None, None, False)


def room_hall_room() -> Building:
    rooms = [
        ("lab", (0, 0, 6, 6)),
        ("hallway", (6.2, 1.8, 18.2, 4.2)),
        ("kitchen", (12, 4.4, 17, 9)),
    ]
    return Building(rooms, [(5.9, 2.3, 6.3, 3.7), (14, 4.1, 15.4, 4.5)], (1.0, 1.0))
