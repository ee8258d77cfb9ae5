"""Worlds of the paper's manipulator: open boxes with things in them, one of which is wanted.

As in the paper the nearest box can be seen from the start and holds the cracker box; the ball lies
in another one, farther than the camera is trusted: 4.5 m indoors, 7 m outdoors. What lies in a box
is seen from above alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from schemas.geometry import Pose2
from sim.assets.library import SMALL, bounds
from sim.scenes.model import Ground, PlacedObject, Region, Wall, World
from sim.scenes.placement import LOOKS, Placement, Spot, random_ground, random_sun

WANTED, OTHER = "ball", "cracker box"
WIDEST = 0.13
"""What the gripper is to take is no wider on its narrow side [m]."""
_inside_height = 0.02
"""At which things are let go above the ground: a little over the floor of the box [m]."""
_at_wall = 0.035
"""Room between a thing and the wall of its box, so that a finger fits in [m]."""
_start_clearance = 1.3
_clearance = 0.75
"""Free space around boxes and obstacles [m]: the robot passes and turns between any two."""
_ahead = math.radians(28.0)
"""The nearest box is in the picture from the start."""
_around = math.radians(75.0)
"""The others are within this angle of where the robot looks."""
_standing = ("suitcase", "cone", "crate", "bin", "post", "sign")


@dataclass(frozen=True)
class Site:
    """Where boxes stand, and how far the camera is trusted there."""

    horizon: float
    """The camera is trusted up to there [m]."""
    nearest: tuple[float, float]
    """Distance of the box that is seen at once [m]."""
    hidden: tuple[float, float]
    """Distance of the box that holds what is wanted [m]."""
    obstacles: int
    room: tuple[float, float, float, float] | None = None
    """Walls around x0, y0, x1, y1, or open country [m]."""

    def holds(self, x: float, y: float) -> bool:
        """Whether a robot can stand on all sides of a thing at a place."""
        if self.room is None:
            return True
        x0, y0, x1, y1 = self.room
        return x0 + _to_wall < x < x1 - _to_wall and y0 + _to_wall < y < y1 - _to_wall


_to_wall = 1.7
INDOORS = Site(
    horizon=4.5,
    nearest=(2.3, 3.6),
    hidden=(5.0, 7.5),
    obstacles=3,
    room=(-3.0, -6.0, 10.0, 6.0),
)
OUTDOORS = Site(horizon=7.0, nearest=(3.0, 5.5), hidden=(8.0, 12.0), obstacles=5)


def make_box_indoor(seed: int) -> World:
    """A room with two boxes: the near one holds a cracker box, the far one the ball."""
    return _paper("box_indoor", seed, INDOORS)


def make_box_outdoor(seed: int) -> World:
    """Two boxes in the open: the near one holds a cracker box, the far one the ball."""
    return _paper("box_outdoor", seed, OUTDOORS)


def make_boxes_indoor(seed: int) -> World:
    """A room with one to five boxes, one of which holds the ball."""
    return _random("boxes_indoor", seed, INDOORS)


def make_boxes_outdoor(seed: int) -> World:
    """One to five boxes in the open, one of which holds the ball."""
    return _random("boxes_outdoor", seed, OUTDOORS)


def put_into(box: PlacedObject, label: str, rng: Generator, name: str) -> PlacedObject:
    """A thing of a class somewhere on the floor of a box, small enough for the gripper."""
    look = small_look(label, rng)
    low, high = bounds("box", box.look)
    inner = (high - low)[:2]
    low, high = bounds(label, look)
    # However it is turned; a ball is the same all round.
    corner = np.maximum(-low, high)[:2]
    reach = float(high[0]) if label == "ball" else float(np.hypot(*corner))
    free = np.maximum(inner / 2 - reach - _at_wall, 0.0)
    x, y = (rng.uniform(-1, 1, 2) * free).tolist()
    return PlacedObject(
        id=name,
        label=label,
        look=look,
        world_from_object=box.world_from_object @ Pose2(x, y, rng.uniform(-math.pi, math.pi)),
        height=_inside_height,
    )


def small_look(label: str, rng: Generator) -> int:
    """A look of a class that the gripper can take: some are larger than that."""
    while True:
        look = int(rng.integers(LOOKS))
        low, high = bounds(label, look)
        if float((high - low)[:2].min()) <= WIDEST:
            return look


def _paper(name: str, seed: int, site: Site) -> World:
    rng = np.random.default_rng([seed, 21 if site.room else 22])
    placement = _placement(rng)
    near = _put_box(placement, _between(rng, site, site.nearest, _ahead))
    far = _put_box(placement, _between(rng, site, site.hidden, _around))
    things = [put_into(near, OTHER, rng, f"{OTHER}_1"), put_into(far, WANTED, rng, f"{WANTED}_1")]
    return _world(name, seed, rng, site, placement, things)


def _random(name: str, seed: int, site: Site) -> World:
    rng = np.random.default_rng([seed, 23 if site.room else 24])
    placement = _placement(rng)
    ring = (site.nearest[0], site.hidden[1])
    spots = [_between(rng, site, ring, _around) for _ in range(int(rng.integers(1, 6)))]
    boxes = [box for spot in spots if (box := placement.put("box", spot)) is not None]
    kinds = [WANTED, *rng.permutation([label for label in SMALL if label != WANTED]).tolist()]
    order = rng.permutation(len(boxes)).tolist()
    # One box in three is empty, but never the one with what is wanted.
    full = [kind == WANTED or rng.random() < 2 / 3 for kind in kinds]
    things = [
        put_into(boxes[index], kind, rng, f"{kind}_1")
        for index, kind, is_full in zip(order, kinds, full, strict=False)
        if is_full
    ]
    return _world(name, seed, rng, site, placement, things)


def _placement(rng: Generator) -> Placement:
    placement = Placement(rng, _clearance)
    placement.reserve(0.0, 0.0, _start_clearance)
    return placement


def _put_box(placement: Placement, spot: Spot) -> PlacedObject:
    box = None
    while box is None:
        box = placement.put("box", spot)
    return box


def _between(rng: Generator, site: Site, ring: tuple[float, float], half_angle: float) -> Spot:
    """Places in a part of a ring around the start, not too near to walls."""

    def draw() -> tuple[float, float]:
        while True:
            radius, angle = rng.uniform(*ring), rng.uniform(-half_angle, half_angle)
            x, y = radius * math.cos(angle), radius * math.sin(angle)
            if site.holds(x, y):
                return x, y

    return draw


def _world(
    name: str,
    seed: int,
    rng: Generator,
    site: Site,
    placement: Placement,
    things: list[PlacedObject],
) -> World:
    """The world with obstacles among the boxes and walls around."""
    for _ in range(site.obstacles):
        label = str(rng.choice(_standing))
        placement.put(label, _between(rng, site, (2.0, site.hidden[1]), math.pi / 2))
    return World(
        name=name,
        seed=seed,
        ground=Ground(kind="concrete", look=int(rng.integers(LOOKS)))
        if site.room
        else random_ground(rng),
        sun=random_sun(rng),
        world_from_start=Pose2(0.0, 0.0, 0.0),
        objects=(*placement.objects, *things),
        walls=_walls(site),
        regions=_regions(site),
    )


def _corners(site: Site) -> tuple[tuple[float, float], ...]:
    if site.room is None:
        return ()
    x0, y0, x1, y1 = site.room
    return (x0, y0), (x1, y0), (x1, y1), (x0, y1)


def _walls(site: Site) -> tuple[Wall, ...]:
    corners = _corners(site)
    ends = (*corners[1:], *corners[:1])
    return tuple(Wall(start=a, end=b) for a, b in zip(corners, ends, strict=True))


def _regions(site: Site) -> tuple[Region, ...]:
    corners = _corners(site)
    return (Region(id="lab_1", kind="lab", corners=corners),) if corners else ()
