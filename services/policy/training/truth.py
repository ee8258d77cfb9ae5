"""What an expert knows that the policy does not: the true map, and the ways on it."""

from collections.abc import Callable

import numpy as np

from robots.spec import RobotSpec
from schemas.arrays import Floats
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from services.policy.terrain import Terrain, terrain_of
from services.policy.travel import travel_from
from sim.assets.library import make_asset
from sim.scenes.model import PlacedObject, World

_half_side = 30.0
"""Of the square of ground that is known, around the start [m]."""
_cell = 0.2
_margin = 0.05
_free, _occupied = -60, 60
"""Log odds in tenths."""
_seen_within = 1.0
"""A seen thing this near to the true goal is the goal [m]."""
_exists_above = 0.5


class TrueWays:
    """Ways on the true map of one world to the nearest of its goals.

    Args:
        world: the ground truth.
        goals: ids of the objects that are meant.
        spec: the robot, for its size.
        world_from_base: its true pose now.
    """

    def __init__(
        self,
        world: World,
        goals: tuple[str, ...],
        spec: RobotSpec,
        world_from_base: Callable[[], Pose2],
    ) -> None:
        self._pose = world_from_base
        self._radius = spec.base.radius + _margin
        self._terrain = _true_terrain(world, world.objects)
        self._goals = _positions([world.find(goal) for goal in goals])
        self._to_goals = [
            travel_from(_without(world, goal), place, self._radius)
            for goal, place in zip(goals, self._goals, strict=True)
        ]

    def from_robot(self, map_from_base: Pose2, places: Floats) -> Floats:
        """Way of the robot to places (N, 2) of the map, which it believes in [m]."""
        here = self._pose()
        travel = travel_from(self._terrain, np.array([here.x, here.y]), self._radius)
        return travel.to(self._in_world(map_from_base, places))

    def to_goal(self, map_from_base: Pose2, places: Floats) -> Floats:
        """Way from places (N, 2) of the map to the nearest goal [m]."""
        true = self._in_world(map_from_base, places)
        return np.min([travel.to(true) for travel in self._to_goals], axis=0)

    def gap(self) -> float:
        """From the robot to the nearest goal in a straight line [m]."""
        here = self._pose()
        return float(np.hypot(*(self._goals - (here.x, here.y)).T).min())

    def is_detected(self, belief: MapBelief, map_from_base: Pose2) -> bool:
        """Whether a goal is among the things that were seen."""
        rows = belief.seen & (belief.existence >= _exists_above)
        seen = self._in_world(map_from_base, belief.position[rows])
        gaps = np.linalg.norm(seen[:, None] - self._goals, axis=-1)
        return bool((gaps < _seen_within).any())

    def _in_world(self, map_from_base: Pose2, places: Floats) -> Floats:
        return (self._pose() @ map_from_base.inverse()).apply(places)


def _without(world: World, goal: str) -> Terrain:
    return _true_terrain(world, tuple(one for one in world.objects if one.id != goal))


def _true_terrain(world: World, objects: tuple[PlacedObject, ...]) -> Terrain:
    """The ground around the start with everything that stands there."""
    count = round(2 * _half_side / _cell)
    start = world.world_from_start
    corner = np.array([start.x, start.y]) - _half_side
    centers = (np.arange(count) + 0.5) * _cell
    x, y = corner[0] + centers[None], corner[1] + centers[:, None]
    occupancy = np.full((count, count), _free, np.int8)
    for (px, py), placed in zip(_positions(objects), objects, strict=True):
        radius = make_asset(placed.label, placed.look).footprint_radius
        occupancy[np.hypot(x - px, y - py) < radius + _cell / 2] = _occupied
    grid = OccupancyGrid(
        stamp_ns=0,
        origin=(float(corner[0]), float(corner[1])),
        resolution=_cell,
        occupancy=occupancy,
        looked=np.full((count, count), _free, np.int8),
    )
    return terrain_of(grid)


def _positions(objects: "list[PlacedObject] | tuple[PlacedObject, ...]") -> Floats:
    poses = [placed.world_from_object for placed in objects]
    return np.array([(pose.x, pose.y) for pose in poses]).reshape(-1, 2)
