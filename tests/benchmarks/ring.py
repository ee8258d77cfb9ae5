"""A world for benchmarks of mapping: things on both sides of a round way, all seen again and again.

Sizes are settings, nothing is drawn at random but the noise of the detections.
"""

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from robots.catalogue import get_robot
from schemas import topics
from schemas.arrays import Floats
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from schemas.language import Annotation, Annotations, BehaviorSymbol, Relation
from schemas.perception import Detections
from schemas.run import RunConfig
from schemas.sensing import LaserScan, Odometry
from schemas.topics import Topic
from services.mapping.node import MappingNode

CLASSES = ("hydrant", "cone", "barrel", "tree", "car")
SPEC = get_robot("husky")
_reach = 7.0
_aside = 2.5
_deviation = 0.05
_directions = np.linspace(-math.pi - 0.1, math.pi + 0.1, 144)


class Ring:
    """A robot on its way round, seen by mapping as the executors run it."""

    def __init__(self, particles: int, objects: int) -> None:
        self._radius = max(5.0, objects / 8)
        self._places, self._kinds = _things(objects, self._radius)
        self._rng = np.random.default_rng(0)
        self._stamp_ns = 0
        self.base = Pose2(0.0, 0.0, 0.0)
        self.handlers = MappingNode(
            RunConfig(particles=particles), np.random.default_rng(1)
        ).handlers()
        self.belief: MapBelief | None = None
        self._take(topics.ODOMETRY, self._odometry())

    def drive_until(self, nodes: int) -> None:
        """One picture a metre until the trajectory has so many pose nodes; nothing was said."""
        while self.belief is None or len(self.belief.trajectory) < nodes:
            self.step(*self.ahead(1.0))

    def hear(self, landmark: str = "cone") -> None:
        """Go to the hydrant behind the landmark."""
        self._take(topics.ANNOTATIONS, _behind(landmark, self._stamp_ns))

    def ahead(self, way: float) -> tuple[Odometry, Detections]:
        """Go on, and what odometry and camera say there."""
        self._stamp_ns += round(way * 1e9)
        self.base = self.base @ Pose2(way, 0.0, way / self._radius)
        return self._odometry(), self._picture()

    def step(self, odometry: Odometry, picture: Detections) -> MapBelief:
        """One step of the filter, from the sensors to the belief."""
        self._take(topics.ODOMETRY, odometry)
        self._take(topics.DETECTIONS, picture)
        assert self.belief is not None
        return self.belief

    def scan(self) -> OccupancyGrid:
        """A scan of open ground, and the grid that is published after it."""
        scan = LaserScan(
            stamp_ns=self._stamp_ns,
            angle_min=-math.pi,
            angle_increment=2 * math.pi / SPEC.laser.beams,
            range_max=SPEC.laser.range_max,
            ranges=np.full(SPEC.laser.beams, 9.0, np.float32),
            base_from_laser=SPEC.laser.base_from_laser,
            odom_from_base=self.base,
        )
        (output,) = self.handlers[topics.SCAN](scan)
        return output.message

    def _take(self, topic: Topic, message: Struct) -> None:
        for output in self.handlers[topic](message):
            assert output.topic is not topics.FAULT, output.message
            if isinstance(output.message, MapBelief):
                self.belief = output.message

    def _odometry(self) -> Odometry:
        noise = SPEC.odometry
        return Odometry(
            stamp_ns=self._stamp_ns,
            odom_from_base=self.base,
            linear=1.0,
            angular=1.0 / self._radius,
            variance_per_metre=noise.variance_per_metre,
            variance_per_radian=noise.variance_per_radian,
        )

    def _picture(self) -> Detections:
        local = self.base.inverse().apply(self._places)
        rows = np.flatnonzero(np.hypot(*local.T) < _reach)
        count = len(rows)
        likely = np.full((count, len(CLASSES)), 0.02)
        likely[np.arange(count), self._kinds[rows]] = 0.85
        seen = local[rows] + _deviation * self._rng.standard_normal((count, 2))
        return Detections(
            stamp_ns=self._stamp_ns,
            classes=CLASSES,
            odom_from_base=self.base,
            boxes_px=np.zeros((count, 4)),
            probabilities=likely,
            scores=np.full(count, 0.85),
            centers_base=np.column_stack([seen, np.full(count, 0.4)]),
            covariances=np.tile(_deviation**2 * np.eye(3), (count, 1, 1)),
            extents=np.tile([0.4, 0.4, 0.8], (count, 1)),
            view_bearings=_directions,
            view_ranges=np.full(len(_directions), _reach),
            view_near=0.0,
            picture_size=(320, 240),
            inference_ms=0.0,
        )


def _things(count: int, radius: float) -> tuple[Floats, Sequence[int]]:
    """Places (K, 2) outside and inside the way by turns, and their classes."""
    angle = 2 * math.pi * np.arange(count) / count
    away = radius + np.where(np.arange(count) % 2, _aside, -_aside)
    places = np.stack([away * np.sin(angle), radius - away * np.cos(angle)], axis=1)
    return places, np.arange(count) % len(CLASSES)


def _behind(landmark: str, stamp_ns: int) -> Annotations:
    relation = Relation("back", "hydrant", landmark)
    return Annotations(
        stamp_ns=stamp_ns,
        instruction_id=f"behind {landmark}",
        text=f"go to the hydrant behind the {landmark}",
        understood=True,
        parse="",
        parse_probability=1.0,
        annotations=(
            Annotation(probability=1.0, objects=(landmark, "hydrant"), relations=(relation,)),
        ),
        behaviors=(
            BehaviorSymbol(
                probability=1.0,
                action="navigate",
                object="hydrant",
                mode="unknown",
                relation="back",
                landmark=landmark,
            ),
        ),
        unknown_words=(),
        question=None,
        possible=(),
    )
