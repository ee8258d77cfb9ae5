"""Perception of a robot with an arm as a model: both cameras, and things as bodies in space.

What is in view is decided by rays through the simulator's bodies, so that a box hides what is in it
from the side and the arm hides what is behind it. Places, sizes and classes are told with errors,
which are settings. Errors are independent from one picture to the next; a real detector's are not.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from sapien import physx

from robots.arm import WristCamera
from robots.arm_kinematics import forward, matrix, pose
from robots.spec import CameraSpec, RobotSpec
from schemas import topics
from schemas.arrays import Floats
from schemas.geometry import Pose2, Pose3
from schemas.perception import Detections
from schemas.sensing import JointState, Odometry
from schemas.task import HandlingStatus, TaskState
from schemas.topics import Handlers, Output
from sim.assets.library import SMALL
from sim.driver import SapienDriver
from sim.experiments.true_bodies import TrueBody, message_of, true_body
from sim.scenes.model import World

_start, _wrist_start = 0.15, 0.05
"""From the middle of a camera to where its rays begin, outside of its housing [m]."""
_least_share = 0.4
"""Of a thing that must be in view for it to be found."""
_directions = 72
_no_view = np.zeros(0)
_nearest = 0.12
"""Nearer than this a camera sees nothing [m]."""


@dataclass(frozen=True)
class BodySettings:
    """How good the modelled perception is."""

    rate_hz: float = 5.0
    detection_probability: float = 0.95
    """Of a thing in plain view, in each picture."""
    deviation_m: float = 0.004
    deviation_per_metre: float = 0.01
    """Deviation of a place, in each direction: constant, and growing with the distance from the
    camera."""
    yaw_deviation: float = 0.03
    """[rad]"""
    size_share: float = 0.02
    """Deviation of a length, as a share of it."""
    confusion: float = 0.03
    """Probability that another class than the true one looks best."""
    confidence: float = 0.85
    """Probability given to the class that looks best."""
    doubt: float = 0.03
    """Probability given to no class at all."""

    @property
    def summary(self) -> str:
        """One line for people."""
        return (
            f"perception modelled at {self.rate_hz:g} Hz: P_D {self.detection_probability:g}, "
            f"{self.confusion:g} confused classes, place deviation {self.deviation_m:g} m + "
            f"{self.deviation_per_metre:g} a metre, occlusion by all bodies"
        )


@dataclass(frozen=True)
class _Eye:
    """A camera where it is now."""

    world_from_camera: Floats
    """(4, 4)"""
    across: Floats
    """(2,) Tangents of half the angles of view."""
    reach: float
    """[m]"""
    start: float
    """[m]"""


class ModelledBodies:
    """Takes the place of the perception process and of both cameras.

    Args:
        world: what stands where at first.
        driver: the simulated robot, which knows where everything is now.
        spec: of the robot, with the field of view of the run.
        settings: errors.
        rng: the only source of randomness.
    """

    def __init__(
        self,
        world: World,
        driver: SapienDriver,
        spec: RobotSpec,
        settings: BodySettings,
        rng: Generator,
    ) -> None:
        symbols = spec.symbols
        self._classes = tuple(c for c in symbols.object_classes if c not in ("unknown", "robot"))
        self._placed = [placed for placed in world.objects if placed.label in self._classes]
        self._driver, self._spec, self._settings, self._rng = driver, spec, settings, rng
        self._odom_from_base = Pose2(0.0, 0.0, 0.0)
        self._due_ns = {"base": 0, "wrist": 0}
        self._handling = False
        self.blind = False
        """For tests: nothing comes from the wrist's camera."""

    def handlers(self) -> Handlers:
        """Odometry and joints set the pace: they come when the truth is that of their stamps."""
        return {
            topics.ODOMETRY: self.on_odometry,
            topics.JOINT_STATE: self.on_joints,
            topics.HANDLING_STATUS: self.on_handling,
        }

    def on_handling(self, status: HandlingStatus) -> Iterable[Output]:
        """As perception does, look through the wrist's camera for as long as the arm works."""
        self._handling = status.state is TaskState.ACTIVE
        return ()

    def on_odometry(self, odometry: Odometry) -> Iterable[Output]:
        """What a picture of the camera on the mast would show now."""
        self._odom_from_base = odometry.odom_from_base
        if not self._is_due("base", odometry.stamp_ns):
            return
        eye = self._mast_eye()
        yield from self._told(eye, self._ground_view(), odometry.stamp_ns, of_wrist=False)

    def on_joints(self, state: JointState) -> Iterable[Output]:
        """What a picture of the wrist's camera would show now."""
        if self.blind or not self._handling or not self._is_due("wrist", state.stamp_ns):
            return
        none = (_no_view, _no_view)
        yield from self._told(self._wrist_eye(), none, state.stamp_ns, of_wrist=True)

    def _is_due(self, camera: str, stamp_ns: int) -> bool:
        due = stamp_ns >= self._due_ns[camera]
        if due:
            self._due_ns[camera] = stamp_ns + round(1e9 / self._settings.rate_hz)
        return due

    def _bodies(self) -> list[TrueBody]:
        loose = self._driver.loose.poses if self._driver.loose else {}
        there = [p for p in self._placed if p.label not in SMALL or p.id in loose]
        return [true_body(placed, loose.get(placed.id)) for placed in there]

    def _mast_eye(self) -> _Eye:
        camera = self._spec.camera
        return _eye(camera, self._in_world(camera.base_from_camera), _start)

    def _wrist_eye(self) -> _Eye:
        arm = self._spec.arm
        assert arm is not None
        foot_from_flange = pose(forward(arm, self._driver.arm_joints))
        mount = arm.base_from_foot @ foot_from_flange @ arm.camera.flange_from_camera
        return _eye(arm.camera, self._in_world(mount), _wrist_start)

    def _in_world(self, base_from_camera: Pose3) -> Floats:
        return matrix(self._driver.world_from_base.lifted() @ base_from_camera)

    def _visible(self, eye: _Eye) -> list[TrueBody]:
        """Things of which enough is in view, less those that are overlooked."""
        shares = [(body, self._share(eye, body)) for body in self._bodies()]
        seen = [body for body, share in shares if share >= _least_share]
        found = self._rng.random(len(seen)) < self._settings.detection_probability
        return [body for body, here in zip(seen, found.tolist(), strict=True) if here]

    def _share(self, eye: _Eye, body: TrueBody) -> float:
        """Share of the points of a thing that are in the picture and not hidden."""
        points = body.world_from_box.apply(_samples * body.size / 2)
        local = (points - eye.world_from_camera[:3, 3]) @ eye.world_from_camera[:3, :3]
        depth = local[:, 2:]
        inside = (np.abs(local[:, :2]) < eye.across * depth).all(axis=1)
        inside &= (depth[:, 0] > _nearest) & (np.linalg.norm(local, axis=1) < eye.reach)
        shown = [self._hits(eye, point, body) for point in points[inside]]
        return sum(shown) / len(points)

    def _hits(self, eye: _Eye, point: Floats, body: TrueBody) -> bool:
        """Whether nothing is before a point of a thing but the thing itself."""
        origin = eye.world_from_camera[:3, 3]
        toward = point - origin
        length = float(np.linalg.norm(toward))
        direction = toward / length
        system = self._driver.scene.physx_system
        assert isinstance(system, physx.PhysxCpuSystem)
        first = (origin + eye.start * direction).tolist()
        # The stub says that a hit always comes back; in truth it is None where nothing is there.
        hits: list[physx.PhysxRayHit | None] = [
            system.raycast(first, direction.tolist(), eye.reach)
        ]
        return all(
            hit is None
            or hit.component.entity.name == body.id
            or hit.distance + eye.start > length - 0.01
            for hit in hits
        )

    def _ground_view(self) -> tuple[Floats, Floats]:
        """Bearings (V,) and how far the ground is in plain view in each of them (V,)."""
        camera, here = self._spec.camera, self._driver.world_from_base
        half = min(camera.horizontal_fov / 2, math.pi)
        bearings = np.linspace(-half, half, _directions)
        ranges = np.full(len(bearings), camera.range_max)
        standing = [body for body in self._bodies() if body.label not in SMALL]
        for body in standing:
            x, y = here.inverse().apply(np.array(body.world_from_box.position[:2])).tolist()
            distance, radius = math.hypot(x, y), float(np.hypot(*body.size[:2])) / 2
            covered = math.asin(min(1.0, radius / max(distance, 1e-6)))
            off = (bearings - math.atan2(y, x) + math.pi) % (2 * math.pi) - math.pi
            hidden = np.abs(off) < covered
            ranges[hidden] = np.minimum(ranges[hidden], max(distance - radius, 0.0))
        return bearings, ranges

    def _told(
        self, eye: _Eye, view: tuple[Floats, Floats], stamp_ns: int, of_wrist: bool
    ) -> Iterable[Output]:
        seen, settings = self._visible(eye), self._settings
        base_from_world = self._driver.world_from_base.inverse().lifted()
        at = eye.world_from_camera[:3, 3].tolist()
        distances = [math.dist(body.world_from_box.position, at) for body in seen]
        deviations = [settings.deviation_m + settings.deviation_per_metre * d for d in distances]
        noisy = [self._noisy(body, sd) for body, sd in zip(seen, deviations, strict=True)]
        variances = [sd**2 for sd in deviations]
        bodies = message_of(noisy, base_from_world, self._odom_from_base, variances, stamp_ns)
        detections = Detections(
            stamp_ns=stamp_ns,
            classes=self._classes,
            odom_from_base=self._odom_from_base,
            boxes_px=np.zeros((len(seen), 4)),
            probabilities=self._probabilities([body.label for body in noisy]),
            scores=np.full(len(seen), settings.confidence),
            centers_base=bodies.positions_base,
            covariances=bodies.covariances[:, :3, :3],
            extents=bodies.sizes,
            view_bearings=view[0],
            view_ranges=view[1],
            view_near=self._spec.camera.near,
            picture_size=(0, 0),
            inference_ms=0.0,
        )
        yield (topics.WRIST_DETECTIONS if of_wrist else topics.DETECTIONS).of(detections)
        yield (topics.WRIST_BODIES if of_wrist else topics.BODIES).of(bodies)

    def _noisy(self, body: TrueBody, deviation: float) -> TrueBody:
        settings, rng = self._settings, self._rng
        x, y, z = (np.array(body.world_from_box.position) + deviation * rng.normal(size=3)).tolist()
        turn = Pose2(0.0, 0.0, settings.yaw_deviation * rng.normal()).lifted()
        confused = rng.random() < settings.confusion
        label = str(rng.choice(self._classes)) if confused else body.label
        return replace(
            body,
            label=label,
            world_from_box=Pose3((x, y, z), (turn @ body.world_from_box).wxyz),
            size=body.size * (1 + settings.size_share * rng.normal(size=3)),
        )

    def _probabilities(self, labels: list[str]) -> Floats:
        settings = self._settings
        rest = (1 - settings.confidence - settings.doubt) / (len(self._classes) - 1)
        table = np.full((len(labels), len(self._classes)), rest)
        columns = [self._classes.index(label) for label in labels]
        table[np.arange(len(labels)), columns] = settings.confidence
        return table


_samples = np.array(
    [(0, 0, 0), (0.7, 0, 0), (-0.7, 0, 0), (0, 0.7, 0), (0, -0.7, 0), (0, 0, 0.7)], np.float64
)
"""Points of a thing, as shares of half its size."""


def _eye(camera: CameraSpec | WristCamera, world_from_camera: Floats, start: float) -> _Eye:
    tangent = math.tan(camera.horizontal_fov / 2)
    across = np.array([tangent, tangent * camera.height / camera.width])
    return _Eye(world_from_camera, across, camera.range_max, start)
