"""Random scenes and views for training the detector."""

from __future__ import annotations

import math

from numpy.random import Generator

from robots.husky.spec import HUSKY
from schemas.geometry import Pose2, Pose3, quaternion_product
from sim.assets.library import DETECTED, DISTRACTORS, make_asset
from sim.scenes.model import PlacedObject, World
from sim.scenes.placement import Placement, in_ring, random_ground, random_sun


def random_scene(rng: Generator) -> World:
    """A crowded place: every class of the detector, and things that are none of them."""
    placement = Placement(rng, clearance=0.15)
    counts = {"building": rng.integers(0, 3), "car": rng.integers(0, 3), "tree": rng.integers(0, 4)}
    counts |= {label: rng.integers(1, 4) for label in ("cone", "hydrant", "barrel")}
    labels = [label for label, number in counts.items() for _ in range(int(number))]
    labels += [str(rng.choice(DISTRACTORS)) for _ in range(int(rng.integers(2, 6)))]
    labels += ["wall"] if rng.random() < 0.25 else []
    for label in labels:
        far = {"building": (9.0, 17.0), "car": (3.0, 12.0), "tree": (2.0, 11.0)}
        placement.put(label, in_ring(rng, *far.get(label, (0.0, 7.0))))
    return World(
        name="training", seed=0, ground=random_ground(rng), sun=random_sun(rng),
        world_from_start=Pose2(0, 0, 0), objects=tuple(placement.objects),
    )  # fmt: skip


def random_view(rng: Generator, scene: World) -> Pose3:
    """A camera about as high and as tilted as the Husky's, mostly looking at some object."""
    while True:
        target = _interesting(rng, scene)
        reach = make_asset(target.label, target.look).footprint_radius
        distance, bearing = reach + rng.uniform(0.8, 12), rng.uniform(-math.pi, math.pi)
        x = target.world_from_object.x + distance * math.cos(bearing)
        y = target.world_from_object.y + distance * math.sin(bearing)
        if _is_clear(scene, x, y):
            break
    off = rng.uniform(-math.pi, math.pi) if rng.random() < 0.1 else rng.normal(0, 0.35)
    return _husky_view(rng, x, y, bearing + math.pi + off)


def _interesting(rng: Generator, scene: World) -> PlacedObject:
    candidates = [placed for placed in scene.objects if placed.label in DETECTED]
    return candidates[int(rng.integers(len(candidates)))]


def _is_clear(scene: World, x: float, y: float) -> bool:
    def distance(placed: PlacedObject) -> float:
        pose, asset = placed.world_from_object, make_asset(placed.label, placed.look)
        return math.hypot(x - pose.x, y - pose.y) - asset.footprint_radius

    return all(distance(placed) > 0.5 for placed in scene.objects)


def _husky_view(rng: Generator, x: float, y: float, yaw: float) -> Pose3:
    mounted = HUSKY.camera.base_from_camera
    pitch, roll = rng.normal(0, 0.05), rng.normal(0, 0.02)
    tilt = quaternion_product(
        (math.cos(pitch / 2), 0.0, math.sin(pitch / 2), 0.0),
        (math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0),
    )
    base = Pose2(x, y, yaw).lifted() @ Pose3((0.0, 0.0, rng.normal(0, 0.08)), tilt)
    return base @ mounted
