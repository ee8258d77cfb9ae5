"""Groups of small things: scattered over a surface, or lying in an open box."""

from __future__ import annotations

import math

import numpy as np

from sim.assets.asset import Asset
from sim.assets.library import SMALL, SMALL_DISTRACTORS
from sim.scenes.training_model import (
    FLOOR,
    FreeSpace,
    Item,
    Span,
    Support,
    rested,
)
from sim.scenes.training_parts import Draw

UPRIGHT = (0.0, 0.0)
_quarter = math.pi / 2
_on_its_side = ((_quarter, 0.0), (-_quarter, 0.0))
_on_its_back = ((0.0, _quarter), (0.0, -_quarter))
LYING: dict[str, tuple[tuple[tuple[float, float], ...], float]] = {
    "drill": (_on_its_side, 0.45),
    "cracker box": ((*_on_its_back, *_on_its_side), 0.4),
    "mustard bottle": (_on_its_back, 0.35),
    "pitcher": (_on_its_side, 0.08),
    "suitcase": (_on_its_back, 0.25),
    "barrel": (_on_its_side, 0.15),
    "bottle": (_on_its_back, 0.4),
    "can": (_on_its_back, 0.3),
    "mug": (_on_its_side, 0.15),
    "carton": (_on_its_side, 0.3),
    "bucket": (_on_its_back, 0.1),
}
"""How a thing lies (roll, pitch) when it does not stand, and how often that is."""
GAP = 0.02
"""Least distance between small things [m]."""
IN_BOX_MARGIN = 0.02


def tilt(draw: Draw, label: str) -> tuple[float, float]:
    """Standing, or one of the ways in which such a thing lies."""
    ways, share = LYING.get(label, ((), 0.0))
    return draw.one(ways) if draw.rng.random() < share else UPRIGHT


def small_asset(draw: Draw, others: float = 0.3) -> Asset:
    """A small object, or with the probability `others` a small thing of none of the classes."""
    only_others = not draw.part.holds_objects
    pool = SMALL_DISTRACTORS if only_others or draw.rng.random() < others else SMALL
    return draw.asset(draw.one(pool))


def scattered(
    draw: Draw, space: FreeSpace, xs: Span, ys: Span, number: range, support: Support = FLOOR
) -> list[Item]:
    """Small things in free places of a rectangle."""
    items: list[Item] = []
    for _ in number:
        item = laid(draw, small_asset(draw), space, xs, ys, support)
        items += [] if item is None else [item]
    return items


def laid(
    draw: Draw, asset: Asset, space: FreeSpace, xs: Span, ys: Span, support: Support = FLOOR
) -> Item | None:
    """The asset somewhere in a rectangle, standing or lying; None if there is no room."""
    way = tilt(draw, asset.label)
    radius = rested(asset, 0.0, 0.0, 0.0, support, way).radius
    place = space.find(xs, ys, radius + GAP)
    return None if place is None else rested(asset, place.x, place.y, place.yaw, support, way)


def contents(draw: Draw, box: Item) -> list[Item]:
    """Up to four small things on the floor of an open box."""
    floor = box.asset.collisions[0]
    half_x, half_y = (half - IN_BOX_MARGIN for half in floor.half[:2])
    inside = Support(2 * floor.half[2], shaded=False)
    space, items = FreeSpace(draw.rng), list[Item]()
    for _ in draw.sized(0, 4):
        item = _packed(draw, space, half_x, half_y, inside)
        items += [] if item is None else [item]
    pose = box.world_from_object
    support = Support(pose.position[2] + inside.height, shaded=False)
    return [Item(one.asset, pose @ one.world_from_object, support) for one in items]


def _packed(
    draw: Draw, space: FreeSpace, half_x: float, half_y: float, inside: Support
) -> Item | None:
    """Something in the frame of the box, wholly between its walls; None if it does not fit."""
    asset = small_asset(draw, 0.2)
    way = tilt(draw, asset.label)
    yaw = draw.rng.uniform(-math.pi, math.pi)
    loose = rested(asset, 0.0, 0.0, yaw, inside, way)
    reach = np.abs(loose.corners[:, :2]).max(axis=0)
    room_x, room_y = half_x - float(reach[0]), half_y - float(reach[1])
    if min(room_x, room_y) < 0:
        return None
    # Things in a box may touch: their discs overlap by a third.
    place = space.find((-room_x, room_x), (-room_y, room_y), 0.67 * loose.radius)
    return None if place is None else rested(asset, place.x, place.y, yaw, inside, way)
