"""The known map: what mapping would publish if it knew everything from the start."""

from collections.abc import Callable, Iterable

import numpy as np

from robots.catalogue import robot_of
from schemas import topics
from schemas.arrays import Flags, Floats
from schemas.belief import MapBelief
from schemas.geometry import Pose2
from schemas.language import Annotations
from schemas.run import RunConfig
from schemas.sensing import Odometry
from schemas.topics import Handlers, Output
from services.mapping.grid import Grid
from sim.assets.library import make_asset
from sim.scenes.model import PlacedObject
from sim.world import make_world

_belief_period_ns, _grid_period_ns = 200_000_000, 500_000_000
_sure = 6.0
"""Log odds."""
_height = 0.8


class TrueMapNode:
    """Publishes one hypothesis, which is true, and the true pose.

    Args:
        run: names the world.
        world_from_base: the robot's true pose now.
        meaning: ids of the objects that an instruction really means.
    """

    def __init__(
        self,
        run: RunConfig,
        world_from_base: Callable[[], Pose2],
        meaning: Callable[[Annotations], tuple[str, ...]],
    ) -> None:
        world = make_world(run.world, run.seed)
        self._classes = robot_of(run).symbols.object_classes
        self._start_from_world = world.world_from_start.inverse()
        self._objects = world.objects
        self._radii = np.array(
            [make_asset(placed.label, placed.look).footprint_radius for placed in world.objects]
        )
        self._positions = self._start_from_world.apply(_positions(world.objects))
        self._world_from_base, self._meaning = world_from_base, meaning
        self._grid = self._known_grid()
        self._instruction_id = ""
        self._figure = self._landmark = -1
        self._viewer = Pose2(0.0, 0.0, 0.0)
        self._belief_due_ns = self._grid_due_ns = 0

    def handlers(self) -> Handlers:
        """The odometry sets the pace."""
        return {topics.ODOMETRY: self.on_odometry, topics.ANNOTATIONS: self.on_annotations}

    def on_annotations(self, annotations: Annotations) -> Iterable[Output]:
        """Learn what is meant."""
        self._instruction_id = annotations.instruction_id
        self._viewer = self._map_from_base()
        meant = self._meaning(annotations)
        ids = [placed.id for placed in self._objects]
        self._figure = ids.index(meant[0]) if meant else -1
        self._landmark = -1
        if meant and annotations.behaviors:
            self._landmark = self._nearest(annotations.behaviors[0].landmark, self._figure)
        return ()

    def on_odometry(self, odometry: Odometry) -> Iterable[Output]:
        """The same map as ever, and where the robot is in it."""
        stamp_ns = odometry.stamp_ns
        if stamp_ns >= self._grid_due_ns:
            self._grid_due_ns = stamp_ns + _grid_period_ns
            yield topics.GRID.of(self._grid.message(stamp_ns))
        if stamp_ns >= self._belief_due_ns:
            self._belief_due_ns = stamp_ns + _belief_period_ns
            yield topics.BELIEF.of(self._belief(odometry))

    def _belief(self, odometry: Odometry) -> MapBelief:
        count, map_from_base = len(self._objects), self._map_from_base()
        names = [p.label if p.label in self._classes else "unknown" for p in self._objects]
        return MapBelief(
            stamp_ns=odometry.stamp_ns,
            instruction_id=self._instruction_id,
            classes=self._classes,
            weights=np.ones(1),
            particle=np.full(count, -1, np.int32),
            node=np.arange(count, dtype=np.int32),
            class_index=np.array([self._classes.index(name) for name in names], np.int32),
            class_probability=np.ones(count),
            position=self._positions,
            covariance=np.tile(1e-4 * np.eye(2), (count, 1, 1)),
            extent=np.column_stack([2 * self._radii, 2 * self._radii, np.full(count, _height)]),
            existence=np.ones(count),
            figure=np.array([self._figure], np.int32),
            landmark=np.array([self._landmark], np.int32),
            topology=np.zeros(1, np.int32),
            node_regions=np.zeros((0, 0), np.int32),
            region_edges=np.zeros((0, 3), np.int32),
            viewer=self._viewer,
            map_from_odom=map_from_base @ odometry.odom_from_base.inverse(),
            map_from_base=map_from_base,
            trajectory=np.zeros((0, 3)),
            effective_particles=1.0,
        )

    def _map_from_base(self) -> Pose2:
        return self._start_from_world @ self._world_from_base()

    def _nearest(self, label: str, figure: int) -> int:
        others = [row for row, placed in enumerate(self._objects) if placed.label == label]
        gaps = np.linalg.norm(self._positions[others] - self._positions[figure], axis=1)
        return others[int(np.argmin(gaps))] if others else -1

    def _known_grid(self) -> Grid:
        grid = Grid((0.0, 0.0))
        grid.looked[:] = -_sure
        grid.occupancy[:] = np.where(self._occupied(grid), _sure, -_sure)
        return grid

    def _occupied(self, grid: Grid) -> Flags:
        height, width = grid.occupancy.shape
        side = grid.message(0).resolution
        x = grid.origin[0] + (np.arange(width) + 0.5) * side
        y = grid.origin[1] + (np.arange(height) + 0.5) * side
        occupied = np.zeros((height, width), np.bool_)
        for (px, py), radius in zip(self._positions, self._radii, strict=True):
            occupied |= np.hypot(x[None] - px, y[:, None] - py) < radius + side / 2
        return occupied


def _positions(objects: tuple[PlacedObject, ...]) -> Floats:
    poses = [placed.world_from_object for placed in objects]
    return np.array([(pose.x, pose.y) for pose in poses]).reshape(-1, 2)
