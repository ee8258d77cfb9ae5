"""Random rooms: furniture that is none of the classes, small things on floor, tables and in boxes.

The walls of the room are not labelled: `sim.assets.wall` says why.
"""

from __future__ import annotations

import math

import numpy as np

from schemas.geometry import Pose3
from sim.assets.asset import Asset
from sim.assets.room import FLOOR_TILE, make_room, room_floor
from sim.rendering.ground import Covering
from sim.scenes.model import Sun
from sim.scenes.training_model import (
    FreeSpace,
    Item,
    Span,
    Support,
    TrainingScene,
    rested,
)
from sim.scenes.training_parts import Draw
from sim.scenes.training_things import contents, laid, scattered

Size = tuple[float, float, float]
AT_WALLS = ("shelf", "cabinet", "sofa", "cabinet", "table")
ON_FLOOR = (("cone", 0, 2), ("suitcase", 1, 2), ("barrel", 0, 1), ("box", 1, 3))
"""Classes of larger objects, least and greatest number in a room."""
OTHERS_ON_FLOOR = ("bin", "chair", "backpack", "plant", "bucket", "carton", "crate")
EDGE = 0.12
"""Things on a table keep this far from its edges, so that their shadows end on it [m]."""


def indoor_scene(draw: Draw) -> TrainingScene:
    """A room with its furniture, and objects of the classes that are found in rooms."""
    rng = draw.rng
    size = rng.uniform(3.6, 8.0), rng.uniform(3.4, 6.5), rng.uniform(2.4, 3.2)
    light, look = draw.look(), draw.look()
    walls = make_room(np.random.default_rng([look, 1]), *size)
    floor = Covering(room_floor(np.random.default_rng([look, 2])), FLOOR_TILE)
    space = FreeSpace(rng)
    shell = Item(walls, Pose3((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)), Support(shaded=False))
    furniture = [*_along_walls(draw, space, size), *_tables(draw, space, size)]
    items = [shell, *furniture, *_on_floor(draw, space, size)]
    for table in furniture:
        items += _on_table(draw, table) if table.label == "table" else []
    items += [thing for box in items if box.label == "box" for thing in contents(draw, box)]
    return TrainingScene(floor, _lamps(light), light, tuple(items), size)


def _along_walls(draw: Draw, space: FreeSpace, size: Size) -> list[Item]:
    """Furniture with its back to a wall, its front to the room."""
    items: list[Item] = []
    for _ in draw.sized(1, 5):
        asset, side = draw.asset(draw.one(AT_WALLS)), int(draw.rng.integers(4))
        deep, wide = asset.size[0], asset.size[1]
        long, reach = ((size[1], size[0]), (size[0], size[1]))[side % 2]
        along = draw.rng.uniform(-1, 1) * max(0.0, long / 2 - wide / 2 - 0.05)
        turn = side * math.pi / 2
        out = np.array([math.cos(turn), math.sin(turn)]) * (reach / 2 - deep / 2 - 0.04)
        across = np.array([-math.sin(turn), math.cos(turn)]) * along
        x, y = (out + across).tolist()
        if space.is_free(x, y, wide / 2):
            space.take(x, y, wide / 2)
            items.append(rested(asset, x, y, turn + math.pi))
    return items


def _tables(draw: Draw, space: FreeSpace, size: Size) -> list[Item]:
    """Tables in the room with a chair or two."""
    items: list[Item] = []
    for _ in draw.sized(0, 2):
        table = draw.asset("table")
        place = space.find(*_inside(size, 0.9), table.footprint_radius * 0.9)
        if place is None:
            continue
        items.append(rested(table, place.x, place.y, place.yaw))
        for _ in draw.sized(0, 2):
            bearing = draw.rng.uniform(-math.pi, math.pi)
            away = table.footprint_radius + 0.1
            x, y = place.x + away * math.cos(bearing), place.y + away * math.sin(bearing)
            if abs(x) < size[0] / 2 - 0.4 and abs(y) < size[1] / 2 - 0.4:
                chair = rested(draw.asset("chair"), x, y, bearing + draw.rng.normal(math.pi, 0.5))
                space.take(x, y, 0.25)
                items.append(chair)
    return items


def _inside(size: Size, margin: float) -> tuple[Span, Span]:
    x, y = size[0] / 2 - margin, size[1] / 2 - margin
    return (-x, x), (-y, y)


def _on_floor(draw: Draw, space: FreeSpace, size: Size) -> list[Item]:
    assets: list[Asset] = []
    if draw.part.holds_objects:
        assets = [draw.asset(name) for name, *span in ON_FLOOR for _ in draw.sized(*span)]
    assets += [draw.asset(draw.one(OTHERS_ON_FLOOR)) for _ in draw.sized(1, 4)]
    xs, ys = _inside(size, 0.5)
    laid_down = [laid(draw, asset, space, xs, ys) for asset in assets]
    items = [item for item in laid_down if item is not None]
    for _ in draw.sized(1, 3):
        x, y, reach = draw.rng.uniform(*xs), draw.rng.uniform(*ys), draw.rng.uniform(0.4, 1.0)
        near_x = max(xs[0], x - reach), min(xs[1], x + reach)
        near_y = max(ys[0], y - reach), min(ys[1], y + reach)
        items += scattered(draw, space, near_x, near_y, draw.sized(3, 7))
    return items


def _on_table(draw: Draw, table: Item) -> list[Item]:
    """Small things on a table's top, and now and then an open box."""
    texture = table.asset.meshes[0].texture
    top = Support(table.top, Covering(texture, 1.0))
    half_x, half_y = table.asset.size[0] / 2 - EDGE, table.asset.size[1] / 2 - EDGE
    xs, ys = (-half_x, half_x), (-half_y, half_y)
    space, items = FreeSpace(draw.rng), list[Item]()
    if draw.part.holds_objects and draw.rng.random() < 0.3:
        box = laid(draw, draw.asset("box"), space, xs, ys, Support(0.0))
        items += [] if box is None else [box]
    items += scattered(draw, space, xs, ys, draw.sized(2, 7), Support(0.0))
    lifted = Pose3((0.0, 0.0, table.top), (1.0, 0.0, 0.0, 0.0))
    pose = lifted @ table.world_from_object
    return [Item(one.asset, pose @ one.world_from_object, top) for one in items]


def _lamps(light: int) -> Sun:
    """Light from windows or lamps, white to warm, bright to dim; all of it from high above."""
    rng = np.random.default_rng([light, 2])
    dim = rng.uniform(0.45, 0.75) if rng.random() < 0.2 else rng.uniform(0.75, 1.1)
    direct, warmth = rng.uniform(0.15, 0.75) * dim, rng.uniform(0.0, 0.4) ** 1.5
    return Sun(
        azimuth=rng.uniform(-math.pi, math.pi),
        elevation=rng.uniform(0.95, 1.45),
        color=(direct * (1 + warmth / 2), direct, direct * (1 - warmth)),
        ambient=rng.uniform(0.45, 0.8) * dim,
    )
