"""Ground truth, for evaluation and training only. Nothing that acts may see any of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import shapely
from scipy.sparse.csgraph import dijkstra
from shapely import affinity
from shapely.geometry.base import BaseGeometry as Outline

from robots.spec import BaseGeometry
from schemas.geometry import Pose2
from sim.assets.asset import CollisionShape
from sim.assets.library import make_asset
from sim.scenes.model import PlacedObject, Region, Wall, World

NEAR = 3.0
"""Objects closer than this are near one another [m]."""
SECTORS = {"back": 0.0, "left": math.pi / 2, "front": math.pi, "right": -math.pi / 2}
"""Direction of each relation from the landmark, from the ray viewer -> landmark [rad]."""
SECTOR_HALF_WIDTH = {"back": 60.0, "front": 60.0, "left": 30.0, "right": 30.0}
"""[deg]; the four sectors share the circle."""
RELATIONS = (*SECTORS, "near", "away", "inside", "unknown")
INSIDE = 1.5
"""Somebody this near to the middle of a place is there, as is whoever is inside [m]."""

_doorstep = 0.3
"""Places whose floors are this near to each other may have a door between them [m]."""
_least_door = 0.01
"""Floor that is free between two places with a door between them [m^2]."""


class OracleError(ValueError):
    """A question that has no answer in this world."""


@dataclass(frozen=True)
class Oracle:
    """What is really where."""

    world: World
    base: BaseGeometry
    pose: Callable[[], Pose2]
    """The robot's true pose now, such as `lambda: driver.world_from_base`."""

    @property
    def world_from_base(self) -> Pose2:
        """The robot's true pose."""
        return self.pose()

    @property
    def objects(self) -> tuple[PlacedObject, ...]:
        """True classes and poses."""
        return self.world.objects

    @cached_property
    def places(self) -> frozenset[str]:
        """Ids of all places."""
        return frozenset(region.id for region in self.world.regions)

    @property
    def kinds(self) -> dict[str, str]:
        """Class of every object and type of every place, by id."""
        objects = {placed.id: placed.label for placed in self.objects}
        return objects | {region.id: region.kind for region in self.world.regions}

    def middle_of(self, name: str) -> tuple[float, float]:
        """Of an object or a place [m]."""
        if name in self.places:
            return self.world.region(name).center
        pose = self.world.find(name).world_from_object
        return pose.x, pose.y

    def distance_to(self, name: str) -> float:
        """From the middle of the robot to the middle of an object or a place [m]."""
        here, (x, y) = self.world_from_base, self.middle_of(name)
        return math.hypot(here.x - x, here.y - y)

    def is_at(self, name: str, reach: float) -> bool:
        """Whether the robot stands within `reach` [m] of an object, or in a place (`INSIDE`)."""
        if name not in self.places:
            return self.distance_to(name) <= reach
        here = self.world_from_base
        floor = outline_of_region(self.world.region(name))
        inside = floor.contains(shapely.Point(here.x, here.y))
        return bool(inside) or self.distance_to(name) <= INSIDE

    def clearance(self) -> float:
        """From the robot's footprint to the nearest obstacle [m]; 0 when they touch."""
        here = self.world_from_base
        half_length, half_width = self.base.length / 2, self.base.width / 2
        body = _moved(shapely.box(-half_length, -half_width, half_length, half_width), here)
        return float(np.min(shapely.distance(body, self._outlines), initial=math.inf))

    @cached_property
    def _outlines(self) -> list[Outline]:
        """Of everything that the robot may bump into."""
        return self.obstacles("")

    def shortest_path_length(self, name: str, stop_at: float = 1.0) -> float:
        """Shortest drive from the start to within `stop_at` of an object's middle [m].

        For a disc as wide as the ways that are planned for the robot, among the true outlines of
        all other objects and the walls. The way to a place ends in its middle.

        Raises:
            OracleError: it cannot be reached.
        """
        others = self.obstacles(name)
        start, radius = self.world.world_from_start, self.base.passage_radius
        length = shortest_path((start.x, start.y), self.middle_of(name), others, radius)
        if math.isinf(length):
            raise OracleError(f"{name!r} cannot be reached in world {self.world.name!r}")
        return length if name in self.places else max(0.0, length - stop_at)

    def obstacles(self, goal: str) -> list[Outline]:
        """Outlines of what is in the way to an object or a place [m]."""
        others = [footprint(placed) for placed in self.objects if placed.id != goal]
        return [*others, *(outline_of_wall(wall) for wall in self.world.walls)]

    def adjoining(self, kind: str, landmark_id: str) -> tuple[str, ...]:
        """Ids of the places of a type that have a door to a place.

        So is meant what is "down", "through" or "past" it, or near: words that say how to go are
        true of many ways.
        """
        others = [r.id for r in self.world.regions if r.kind == kind and r.id != landmark_id]
        return tuple(name for name in others if have_door(self.world, name, landmark_id))

    def satisfying(self, label: str, relation: str, landmark_id: str) -> tuple[str, ...]:
        """Ids of the objects of a class that stand in a relation to a landmark.

        Sides are those that somebody at the robot's start sees: "back" is beyond the landmark.

        Raises:
            OracleError: the relation is not in `RELATIONS`.
        """
        if relation not in RELATIONS:
            raise OracleError(f"no relation {relation!r}; there are: {', '.join(RELATIONS)}")
        candidates = [p for p in self.objects if p.label == label and p.id != landmark_id]
        landmark = self.world.find(landmark_id)
        return tuple(p.id for p in candidates if self._holds(relation, p, landmark))

    def nearest(self, label: str, landmark_id: str) -> str:
        """Id of the object of a class that is nearest to a landmark.

        Raises:
            OracleError: the world has no object of that class beside the landmark.
        """
        candidates = [p for p in self.objects if p.label == label and p.id != landmark_id]
        if not candidates:
            raise OracleError(f"no {label!r} besides {landmark_id!r} in world {self.world.name!r}")
        landmark = self.world.find(landmark_id).world_from_object
        return min(candidates, key=lambda placed: _distance(placed.world_from_object, landmark)).id

    def _holds(self, relation: str, figure: PlacedObject, thing: PlacedObject) -> bool:
        pose, viewer = figure.world_from_object, self.world.world_from_start
        landmark, outline = thing.world_from_object, footprint(thing)
        if relation in ("near", "away"):
            return (_distance(pose, landmark) < NEAR) == (relation == "near")
        if relation == "unknown":
            return True
        if relation == "inside":
            return bool(outline.contains(shapely.Point(pose.x, pose.y)))
        ray = math.atan2(landmark.y - viewer.y, landmark.x - viewer.x)
        direction = math.atan2(pose.y - landmark.y, pose.x - landmark.x)
        off = direction - ray - SECTORS[relation]
        return math.cos(off) >= math.cos(math.radians(SECTOR_HALF_WIDTH[relation]))


def _distance(first: Pose2, second: Pose2) -> float:
    return math.hypot(first.x - second.x, first.y - second.y)


@lru_cache(maxsize=1024)
def footprint(placed: PlacedObject) -> Outline:
    """Union of an object's collision shapes seen from above, in the world [m]."""
    shapes = [_outline(shape) for shape in make_asset(placed.label, placed.look).collisions]
    scaled = affinity.scale(shapely.union_all(shapes), placed.scale, placed.scale, origin=(0, 0))
    return _moved(scaled, placed.world_from_object)


def outline_of_wall(wall: Wall) -> Outline:
    """A wall seen from above [m]."""
    middle = shapely.LineString([wall.start, wall.end])
    return middle.buffer(wall.thickness / 2, cap_style="flat")


def outline_of_region(region: Region) -> shapely.Polygon:
    """The floor of a place [m]."""
    return shapely.Polygon(region.corners)


def have_door(world: World, first: str, second: str) -> bool:
    """Whether one can go straight from one place to another."""
    places = [outline_of_region(world.region(name)) for name in (first, second)]
    between = places[0].buffer(_doorstep / 2).intersection(places[1].buffer(_doorstep / 2))
    walls = shapely.union_all([outline_of_wall(wall) for wall in world.walls])
    return between.difference(walls).area > _least_door


def _outline(shape: CollisionShape) -> Outline:
    x, y, _ = shape.center
    half_x, half_y, _ = shape.half
    if shape.kind != "box":
        return shapely.Point(x, y).buffer(half_x, quad_segs=4)
    return shapely.box(x - half_x, y - half_y, x + half_x, y + half_y)


def _moved(geometry: Outline, pose: Pose2) -> Outline:
    turned = affinity.rotate(geometry, pose.yaw, origin=(0, 0), use_radians=True)
    return affinity.translate(turned, pose.x, pose.y)


def shortest_path(
    start: tuple[float, float],
    end: tuple[float, float],
    obstacles: list[Outline],
    radius: float,
) -> float:
    """Length [m] of the shortest path of a disc among obstacles; infinite if there is none.

    Dijkstra on the visibility graph of the obstacles grown by `radius`. Obstacles that already
    touch the start or the end are left out.
    """
    ends = [shapely.Point(start), shapely.Point(end)]
    grown = [obstacle.buffer(radius, quad_segs=3) for obstacle in obstacles]
    grown = [area for area in grown if not any(area.intersects(point) for point in ends)]
    blocked = shapely.union_all([area.buffer(-1e-3) for area in grown])
    corners = [shapely.get_coordinates(area)[:-1] for area in grown]
    nodes = np.concatenate([np.array([start, end]), *corners])
    nodes = nodes[~shapely.contains_xy(blocked, nodes[:, 0], nodes[:, 1])]
    first, second = np.triu_indices(len(nodes), 1)
    edges = np.stack([nodes[first], nodes[second]], axis=1)
    shapely.prepare(blocked)
    free = ~shapely.intersects(blocked, shapely.linestrings(edges))
    lengths = np.zeros((len(nodes), len(nodes)))
    lengths[first[free], second[free]] = np.linalg.norm(edges[free, 0] - edges[free, 1], axis=1)
    return float(dijkstra(lengths, directed=False, indices=0)[1])
