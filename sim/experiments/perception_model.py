"""Perception as a model: reads the ground truth and reports it as a detector would.

Where the Monte Carlo runs need thousands of pictures, nothing is drawn. Field of view, occlusion,
noise, missed and false detections and confused classes are settings, which are printed with the
results. Errors are independent from one picture to the next; a real detector's are not. Walls hide
what is behind them; kinds of places are recognised by `sim.experiments.scene_model`.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator

from robots.spec import CameraSpec
from schemas import topics
from schemas.arrays import Flags, Floats, Ints
from schemas.geometry import Pose2
from schemas.perception import Detections
from schemas.sensing import Odometry
from schemas.topics import Handlers, Output
from sim.assets.library import make_asset
from sim.experiments.scene_model import SceneModel, SceneSettings
from sim.experiments.sight import Walls
from sim.scenes.model import World

CLASSES = ("cone", "hydrant", "barrel", "tree", "car", "building")
"""What the modelled detector looks for, as the trained one."""
_alike = (0, 1, 2)
"""Classes that are taken for one another, and for which shadows are taken."""
_directions = 144
_height = 0.8


@dataclass(frozen=True)
class PerceptionSettings:
    """How good the modelled perception is."""

    rate_hz: float = 5.0
    detection_probability: float = 0.9
    """Of an object in plain view, in each picture."""
    false_per_picture: float = 0.02
    """Probability that a picture shows something that is not there, anywhere in view."""
    confusion: float = 0.05
    """Probability that another class than the true one looks best."""
    deviation_m: float = 0.05
    deviation_per_metre: float = 0.03
    """Deviation of a position, in each direction: constant, and growing with the distance."""
    confidence: float = 0.8
    """Probability given to the class that looks best."""
    doubt: float = 0.05
    """Probability given to no class at all."""
    places: SceneSettings = field(default_factory=SceneSettings)
    """Of kinds of places; not used in worlds without."""

    @property
    def summary(self) -> str:
        """One line for people."""
        return (
            f"perception modelled at {self.rate_hz:g} Hz: P_D {self.detection_probability:g}, "
            f"{self.false_per_picture:g} false detections a picture, "
            f"{self.confusion:g} confused classes, position deviation {self.deviation_m:g} m + "
            f"{self.deviation_per_metre:g} a metre, occlusion by all objects"
        )


@dataclass(frozen=True)
class _Around:
    """The K objects of the world in polar coordinates of the base frame."""

    distance: Floats
    """(K,) to the middle [m]."""
    bearing: Floats
    """(K,) [rad]"""
    radius: Floats
    """(K,) [m]"""

    @property
    def half_angle(self) -> Floats:
        """(K,) Half of the angle that an object covers [rad]."""
        return np.arcsin(np.minimum(self.radius / np.maximum(self.distance, 1e-6), 1.0))


class ModelledPerception:
    """Takes the place of the perception process and of the camera.

    Args:
        world: the ground truth.
        world_from_base: the robot's true pose now.
        camera: its range and angle are the field of view.
        settings: errors.
        rng: the only source of randomness.
        locations: types of places that the robot has words for.
    """

    def __init__(
        self,
        world: World,
        world_from_base: Callable[[], Pose2],
        camera: CameraSpec,
        settings: PerceptionSettings,
        rng: Generator,
        locations: tuple[str, ...] = (),
    ) -> None:
        poses = [placed.world_from_object for placed in world.objects]
        assets = [make_asset(placed.label, placed.look) for placed in world.objects]
        self._positions = np.array([(pose.x, pose.y) for pose in poses]).reshape(-1, 2)
        self._radii = np.array([asset.footprint_radius for asset in assets])
        self._classes = np.array([CLASSES.index(p.label) for p in world.objects], np.int32)
        self._world_from_base = world_from_base
        self._camera, self._settings, self._rng = camera, settings, rng
        self._walls = Walls(world.walls)
        self._places = SceneModel(world, locations, camera, settings.places, rng)
        self._due_ns = 0

    def handlers(self) -> Handlers:
        """The odometry sets the pace: it comes when the truth is that of its stamp."""
        return {topics.ODOMETRY: self.on_odometry}

    def on_odometry(self, odometry: Odometry) -> Iterable[Output]:
        """What a picture taken now would show."""
        if odometry.stamp_ns < self._due_ns:
            return
        self._due_ns = odometry.stamp_ns + round(1e9 / self._settings.rate_hz)
        here = self._world_from_base()
        scene = self._places.observe(here, odometry)
        if scene is not None:
            yield topics.SCENE.of(scene)
        yield topics.DETECTIONS.of(self._detections(here, odometry))

    def _around(self, world_from_base: Pose2) -> _Around:
        x, y = world_from_base.inverse().apply(self._positions).T
        return _Around(np.hypot(x, y), np.arctan2(y, x), self._radii)

    def _detections(self, here: Pose2, odometry: Odometry) -> Detections:
        around = self._around(here)
        bearings, ranges = self._view(around, here)
        seen = np.flatnonzero(self._detected(around, here))
        points = self._noisy(_cartesian(around.distance[seen], around.bearing[seen]))
        classes = self._looking_like(self._classes[seen])
        radii = self._radii[seen]
        if self._rng.random() < self._settings.false_per_picture:
            points = np.concatenate([points, self._anywhere(here)])
            classes = np.append(classes, np.int32(self._rng.choice(_alike)))
            radii = np.append(radii, 0.2)
        return Detections(
            stamp_ns=odometry.stamp_ns,
            classes=CLASSES,
            odom_from_base=odometry.odom_from_base,
            boxes_px=np.zeros((len(points), 4)),
            probabilities=self._probabilities(classes),
            scores=np.full(len(points), self._settings.confidence),
            centers_base=np.column_stack([points, np.full(len(points), _height / 2)]),
            covariances=self._covariances(points),
            extents=np.column_stack([2 * radii, 2 * radii, np.full(len(points), _height)]),
            view_bearings=bearings,
            view_ranges=ranges,
            view_near=self._camera.near,
            picture_size=(0, 0),
            inference_ms=0.0,
        )

    def _detected(self, around: _Around, here: Pose2) -> Flags:
        in_view = (around.distance < self._camera.range_max) & (
            np.abs(around.bearing) <= self._camera.horizontal_fov / 2
        )
        found = self._rng.random(len(in_view)) < self._settings.detection_probability
        walled = around.distance > self._walls.reach(here, around.bearing)
        return in_view & found & ~_hidden(around) & ~walled

    def _view(self, around: _Around, here: Pose2) -> tuple[Floats, Floats]:
        """Bearings, and how far the ground is in plain view: up to the rim, an object or a wall."""
        half = self._camera.horizontal_fov / 2
        # A view all round has no edge: its ends overlap.
        half = half if half < math.pi else math.pi + 0.1
        bearings = np.linspace(-half, half, _directions)
        covered = np.abs(_wrapped(bearings[:, None] - around.bearing)) < around.half_angle
        ends = np.where(covered, around.distance - around.radius, np.inf)
        ends = np.minimum(ends.min(axis=1, initial=np.inf), self._walls.reach(here, bearings))
        return bearings, np.minimum(ends, self._camera.range_max)

    def _noisy(self, points: Floats) -> Floats:
        return points + self._deviations(points)[:, None] * self._rng.normal(size=points.shape)

    def _deviations(self, points: Floats) -> Floats:
        distance = np.hypot(*points.T)
        return self._settings.deviation_m + self._settings.deviation_per_metre * distance

    def _covariances(self, points: Floats) -> Floats:
        return self._deviations(points)[:, None, None] ** 2 * np.eye(3)

    def _anywhere(self, here: Pose2) -> Floats:
        """One place (1, 2), evenly spread over the field of view, or at a wall before it."""
        half = self._camera.horizontal_fov / 2
        distance = np.array([self._camera.range_max * math.sqrt(self._rng.random())])
        bearing = self._rng.uniform(-half, half, 1)
        return _cartesian(np.minimum(distance, self._walls.reach(here, bearing)), bearing)

    def _looking_like(self, classes: Ints) -> Ints:
        confused = self._rng.random(len(classes)) < self._settings.confusion
        others = self._rng.choice(_alike, len(classes)).astype(np.int32)
        return np.where(confused, others, classes)

    def _probabilities(self, classes: Ints) -> Floats:
        settings = self._settings
        rest = (1 - settings.confidence - settings.doubt) / (len(CLASSES) - 1)
        table = np.full((len(classes), len(CLASSES)), rest)
        table[np.arange(len(classes)), classes] = settings.confidence
        return table


def _hidden(around: _Around) -> Flags:
    """Whether the middle (K,) of each object lies behind a nearer one."""
    apart = np.abs(_wrapped(around.bearing[:, None] - around.bearing))
    nearer = around.distance[None] < around.distance[:, None]
    hidden: Flags = np.any(nearer & (apart < around.half_angle[None]), axis=1)
    return hidden


def _cartesian(distance: Floats, bearing: Floats) -> Floats:
    return distance[:, None] * np.column_stack([np.cos(bearing), np.sin(bearing)])


def _wrapped(angle: Floats) -> Floats:
    return (angle + np.pi) % (2 * np.pi) - np.pi
