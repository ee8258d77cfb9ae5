"""Mapping as a node: sensors and language in, the distribution over maps out."""

from collections.abc import Iterable

import numpy as np

from robots.catalogue import robot_of
from schemas import topics
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from schemas.language import Annotations
from schemas.perception import Detections, Inspection, SceneObservation
from schemas.run import RunConfig
from schemas.sensing import LaserScan, Odometry
from schemas.topics import Handlers, Output
from services.mapping.annotations import readings_of
from services.mapping.belief import belief_of
from services.mapping.filter import SemanticFilter
from services.mapping.gate import Gate
from services.mapping.grid import Grid
from services.mapping.odometer import OdometryNoise
from services.mapping.restoration import restore

_grid_period_ns = 500_000_000


class MappingNode:
    """Publishes a belief after every picture and utterance, and the grid twice a second.

    Args:
        run: names the robot.
        rng: the filter's only source of randomness.
        filter_class: another filter than the robot's own.
    """

    def __init__(
        self,
        run: RunConfig,
        rng: np.random.Generator,
        filter_class: type[SemanticFilter] = SemanticFilter,
    ) -> None:
        robot = robot_of(run)
        grid = Grid((0.0, 0.0), robot.laser.grid_resolution)
        self._filter = filter_class(robot.symbols, robot.camera, run.particles, rng, grid)
        self._gate = Gate(robot.limits, self._filter.classes, self._filter.faults, self._jump)
        self._odom_from_base = Pose2(0.0, 0.0, 0.0)
        self._containers = robot.symbols.containers
        self._instruction_id = ""
        self._heard_at: dict[str, Pose2] = {}
        self._last_grid_ns: int | None = None

    def handlers(self) -> Handlers:
        """See `services.runtime.node.Node`."""
        return self._gate.guarded(
            {
                topics.ODOMETRY: self.on_odometry,
                topics.SCAN: self.on_scan,
                topics.SCENE: self.on_scene,
                topics.DETECTIONS: self.on_detections,
                topics.ANNOTATIONS: self.on_annotations,
                topics.WRIST_DETECTIONS: self.on_wrist_detections,
                topics.INSPECTION: self.on_inspection,
            }
        )

    def resume(self) -> Handlers:
        """See `services.runtime.node.Resumable`."""
        return {topics.BELIEF: self.on_own_belief, topics.GRID: self.on_own_grid}

    def on_odometry(self, message: Odometry) -> Iterable[Output]:
        """Follow dead reckoning."""
        noise = OdometryNoise(message.variance_per_metre, message.variance_per_radian)
        self._odom_from_base = message.odom_from_base
        self._filter.move(message.odom_from_base, noise)
        return ()

    def on_scan(self, message: LaserScan) -> Iterable[Output]:
        """Enter the scan into the grid; publish that twice a second."""
        self._filter.scan(message)
        last = self._last_grid_ns
        if last is not None and 0 <= message.stamp_ns - last < _grid_period_ns:
            return ()
        self._last_grid_ns = message.stamp_ns
        return (topics.GRID.of(self._filter.grid.message(message.stamp_ns)),)

    def on_detections(self, message: Detections) -> Iterable[Output]:
        """One step of the filter."""
        self._odom_from_base = message.odom_from_base
        self._filter.observe(message)
        return self._belief(message.stamp_ns)

    def on_wrist_detections(self, message: Detections) -> Iterable[Output]:
        """What the wrist's camera shows, which the next belief will say."""
        self._filter.observe_closely(message)
        return ()

    def on_inspection(self, message: Inspection) -> Iterable[Output]:
        """What a look into something showed, and that nothing was there."""
        self._filter.inspect(message)
        return self._belief(message.stamp_ns)

    def on_scene(self, message: SceneObservation) -> Iterable[Output]:
        """What kinds of places a picture shows, which the next belief will say."""
        self._filter.glance(message)
        return ()

    def on_annotations(self, message: Annotations) -> Iterable[Output]:
        """Take what was said as evidence, again only if it has changed."""
        name = message.instruction_id
        heard_at = self._heard_at.setdefault(name, self._odom_from_base)
        readings = readings_of(message, self._filter.classes, self._containers)
        known = name == self._instruction_id
        if not readings or (known and readings == self._filter.readings):
            return ()
        if known and not self._filter.readings:
            self._filter.recall(readings)
        else:
            self._instruction_id = name
            self._filter.hear(readings, self._heard_at.get(message.viewpoint, heard_at))
        return self._belief(message.stamp_ns)

    def on_own_belief(self, message: MapBelief) -> Iterable[Output]:
        """Take up the belief that this process published before it was killed."""
        restore(self._filter, message)
        self._instruction_id = message.instruction_id
        odom_from_map = message.map_from_odom.inverse()
        self._odom_from_base = odom_from_map @ message.map_from_base
        self._gate.resume(message.stamp_ns, self._odom_from_base)
        self._heard_at[message.instruction_id] = odom_from_map @ message.viewer
        return ()

    def on_own_grid(self, message: OccupancyGrid) -> Iterable[Output]:
        """Take up the grid that this process published before it was killed."""
        self._filter.grid.restore(message)
        self._last_grid_ns = message.stamp_ns
        return ()

    def _jump(self, before: Pose2, after: Pose2) -> None:
        self._filter.jump(before, after)
        # What was heard was heard at the same places, which have other names now.
        new_from_old = after @ before.inverse()
        self._heard_at = {name: new_from_old @ pose for name, pose in self._heard_at.items()}

    def _belief(self, stamp_ns: int) -> Iterable[Output]:
        if self._instruction_id and not self._filter.readings:
            # After a restart, until the utterance is known again, the last belief stands.
            return ()
        belief = belief_of(self._filter, stamp_ns, self._instruction_id, self._odom_from_base)
        return (topics.BELIEF.of(belief),)
