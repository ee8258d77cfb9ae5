"""The known map: what mapping would publish if it knew everything from the start."""

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import shapely

from robots.catalogue import robot_of
from schemas import topics
from schemas.arrays import Flags, Floats, Ints
from schemas.belief import MapBelief, first_topology, shared
from schemas.geometry import Pose2
from schemas.language import Annotations
from schemas.run import RunConfig
from schemas.sensing import Odometry
from schemas.topics import Handlers, Output
from services.mapping.grid import Grid
from sim.assets.library import make_asset
from sim.oracle import have_door, outline_of_wall
from sim.scenes.model import World
from sim.world import make_world

_belief_period_ns, _grid_period_ns = 200_000_000, 500_000_000
_sure = 6.0
"""Log odds."""
_height = 0.8
_first_region = 2000
"""Ids of places begin here, as in mapping's beliefs."""


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
        symbols = robot_of(run).symbols
        self._classes = (*symbols.object_classes, *symbols.locations)
        self._start_from_world = world.world_from_start.inverse()
        self._things = _things(world, self._start_from_world)
        self._edges = _region_edges(world, self._things)
        self._walls = [outline_of_wall(wall) for wall in world.walls]
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
        self._figure = self._things.ids.index(meant[0]) if meant else -1
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
        things, map_from_base = self._things, self._map_from_base()
        count = len(things.ids)
        figure, landmark = (
            things.node[row] if row >= 0 else -1 for row in (self._figure, self._landmark)
        )
        return MapBelief(
            stamp_ns=odometry.stamp_ns,
            instruction_id=self._instruction_id,
            classes=self._classes,
            weights=np.ones(1),
            particle=things.particle,
            node=things.node,
            class_index=np.array([self._class_of(row) for row in range(count)], np.int32),
            class_probability=np.ones(count),
            position=things.position,
            covariance=np.tile(1e-4 * np.eye(2), (count, 1, 1)),
            extent=things.extent,
            existence=np.ones(count),
            figure=np.array([figure], np.int32),
            landmark=np.array([landmark], np.int32),
            figure_class=np.array([self._class_of(self._figure)], np.int32),
            landmark_class=np.array([self._class_of(self._landmark)], np.int32),
            topology=np.zeros(1, np.int32),
            node_regions=np.zeros((0, 0), np.int32),
            region_edges=self._edges,
            viewer=self._viewer,
            map_from_odom=map_from_base @ odometry.odom_from_base.inverse(),
            map_from_base=map_from_base,
            trajectory=np.zeros((0, 3)),
            effective_particles=1.0,
        )

    def _class_of(self, row: int) -> int:
        """Of a thing by its row, -1 for none."""
        label = self._things.labels[row] if row >= 0 else ""
        if not label:
            return -1
        return self._classes.index(label if label in self._classes else "unknown")

    def _map_from_base(self) -> Pose2:
        return self._start_from_world @ self._world_from_base()

    def _nearest(self, label: str, figure: int) -> int:
        things = self._things
        others = [row for row, name in enumerate(things.labels) if name == label]
        gaps = np.linalg.norm(things.position[others] - things.position[figure], axis=1)
        return others[int(np.argmin(gaps))] if others else -1

    def _known_grid(self) -> Grid:
        grid = Grid((0.0, 0.0))
        grid.looked[:] = -_sure
        grid.occupancy[:] = np.where(self._occupied(grid), _sure, -_sure)
        return grid

    def _occupied(self, grid: Grid) -> Flags:
        height, width = grid.occupancy.shape
        side = grid.resolution
        x = grid.origin[0] + (np.arange(width) + 0.5) * side
        y = grid.origin[1] + (np.arange(height) + 0.5) * side
        occupied = np.zeros((height, width), np.bool_)
        solid = self._things.particle == shared
        radii = self._things.extent[solid, 0] / 2
        for (px, py), radius in zip(self._things.position[solid], radii, strict=True):
            occupied |= np.hypot(x[None] - px, y[:, None] - py) < radius + side / 2
        if self._walls:
            cells = np.stack(np.meshgrid(x, y), axis=-1)
            world = self._start_from_world.inverse().apply(cells)
            solid_walls = shapely.union_all(self._walls).buffer(side / 2)
            occupied |= shapely.contains_xy(solid_walls, world[..., 0], world[..., 1])
        return occupied


@dataclass(frozen=True)
class _Things:
    """Objects and places as the belief's columns."""

    ids: tuple[str, ...]
    labels: tuple[str, ...]
    particle: Ints
    node: Ints
    position: Floats
    """(M, 2), map frame [m]."""
    extent: Floats


def _things(world: World, start_from_world: Pose2) -> _Things:
    radii = [make_asset(placed.label, placed.look).footprint_radius for placed in world.objects]
    boxes = [_box(start_from_world.apply(np.array(region.corners))) for region in world.regions]
    middles = [region.center for region in world.regions]
    poses = [placed.world_from_object for placed in world.objects]
    points = np.array([*((pose.x, pose.y) for pose in poses), *middles]).reshape(-1, 2)
    sides = np.array([*((2 * radius, 2 * radius) for radius in radii), *boxes]).reshape(-1, 2)
    objects, places = len(world.objects), len(world.regions)
    return _Things(
        ids=(*(p.id for p in world.objects), *(r.id for r in world.regions)),
        labels=(*(p.label for p in world.objects), *(r.kind for r in world.regions)),
        particle=np.repeat(np.array([shared, first_topology], np.int32), (objects, places)),
        node=np.concatenate([np.arange(objects), _first_region + np.arange(places)]).astype(
            np.int32
        ),
        position=start_from_world.apply(points),
        extent=np.column_stack([sides, np.full(objects + places, _height)]),
    )


def _box(corners: Floats) -> tuple[float, float]:
    """Sides of the box around points (N, 2), along the axes [m]."""
    x, y = np.ptp(corners, axis=0).tolist()
    return x, y


def _region_edges(world: World, things: _Things) -> Ints:
    """Doors, as `MapBelief.region_edges`."""
    node = dict(zip(things.ids, things.node.tolist(), strict=True))
    ids = [region.id for region in world.regions]
    pairs = [(a, b) for a, b in itertools.combinations(ids, 2) if have_door(world, a, b)]
    return np.array([(0, node[a], node[b]) for a, b in pairs], np.int32).reshape(-1, 3)
