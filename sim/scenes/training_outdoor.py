"""Random places outdoors: a crowded yard, with small things on the ground here and there."""

from __future__ import annotations

import math

import numpy as np

from sim.assets.library import DISTRACTORS
from sim.scenes.model import Ground, Sun
from sim.scenes.placement import in_ring, random_ground, random_sun
from sim.scenes.training_model import (
    FreeSpace,
    Item,
    TrainingScene,
    rested,
)
from sim.scenes.training_parts import Draw
from sim.scenes.training_things import contents, laid, scattered, tilt

RINGS = {"building": (9.0, 17.0), "car": (3.5, 12.0), "tree": (2.0, 11.0), "wall": (3.0, 10.0)}
"""Distance of large things from the middle [m]; others stand within `NEAR`."""
NEAR = (0.0, 7.0)
NUMBERS = {
    "building": (1, 2),
    "car": (1, 2),
    "tree": (1, 3),
    "wall": (1, 2),
    "cone": (1, 3),
    "hydrant": (1, 3),
    "barrel": (1, 3),
    "suitcase": (0, 1),
    "box": (0, 2),
}
CLEARANCE = 0.15
"""[m]"""
_tries = 60


def outdoor_scene(draw: Draw) -> TrainingScene:
    """Every class of the detector, or none of them, and things that are none."""
    space = FreeSpace(draw.rng)
    items: list[Item] = []
    for label in _labels(draw):
        item = _stood(draw, space, label)
        items += [] if item is None else [item]
    items += [thing for box in items if box.label == "box" for thing in contents(draw, box)]
    for _ in draw.sized(1, 3):
        items += _heap(draw, space)
    light = draw.look()
    ground = random_ground(draw.rng)
    return TrainingScene(
        Ground(kind=ground.kind, look=draw.look()), _daylight(light), light, tuple(items)
    )


def _labels(draw: Draw) -> list[str]:
    """Large things first: they need most room."""
    labels: list[str] = []
    if draw.part.holds_objects:
        labels = [label for label, span in NUMBERS.items() for _ in draw.sized(*span)]
    others = draw.sized(2, 6) if labels else draw.sized(6, 14)
    return labels + [draw.one(DISTRACTORS) for _ in others]


def _stood(draw: Draw, space: FreeSpace, label: str) -> Item | None:
    asset, way = draw.asset(label), tilt(draw, label)
    spot = in_ring(draw.rng, *RINGS.get(label, NEAR))
    radius = rested(asset, 0.0, 0.0, 0.0, tilt=way).radius + CLEARANCE
    for _ in range(_tries):
        x, y = spot()
        if space.is_free(x, y, radius):
            space.take(x, y, radius)
            return rested(asset, x, y, draw.rng.uniform(-math.pi, math.pi), tilt=way)
    return None


def _heap(draw: Draw, space: FreeSpace) -> list[Item]:
    """Small things close together on the ground, now and then with a box or a suitcase."""
    place = space.find((-6.0, 6.0), (-6.0, 6.0), 0.5)
    if place is None:
        return []
    reach = draw.rng.uniform(0.4, 1.1)
    xs, ys = (place.x - reach, place.x + reach), (place.y - reach, place.y + reach)
    own, items = FreeSpace(draw.rng), list[Item]()
    if draw.part.holds_objects and draw.rng.random() < 0.6:
        item = laid(draw, draw.asset(draw.one(("box", "suitcase", "box"))), own, xs, ys)
        items += [] if item is None else [item]
        items += contents(draw, items[0]) if items and items[0].label == "box" else []
    return items + scattered(draw, own, xs, ys, draw.sized(4, 8))


def _daylight(light: int) -> Sun:
    """Sun or clouds, and one time in six dusk."""
    rng = np.random.default_rng([light, 1])
    sun = random_sun(rng)
    dim = rng.uniform(0.45, 0.75) if rng.random() < 1 / 6 else 1.0
    red, green, blue = sun.color
    return Sun(
        azimuth=sun.azimuth,
        elevation=sun.elevation,
        color=(dim * red, dim * green, dim * blue),
        ambient=dim * sun.ambient,
    )
