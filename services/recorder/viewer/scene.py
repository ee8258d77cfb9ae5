"""The belief and the robot as things in space."""

import numpy as np
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.TextPrimitive_pb2 import TextPrimitive
from numpy.typing import NDArray

from robots.colours import BLUE, GREY, class_colour
from robots.spec import RobotSpec
from schemas.arrays import Floats
from schemas.belief import MapBelief, first_topology, shared
from schemas.sensing import Odometry
from services.recorder.viewer.parts import (
    BASE,
    MAP,
    colour,
    on_floor,
    points,
    pose_at,
    time_of,
    vector,
)

GUESSES_DRAWN = 300
"""Of the guessed objects of one class those of the heaviest hypotheses are drawn."""
_faintest, _strongest = 0.08, 0.6
_surely_there = 0.3
"""Seen objects that exist less probably are passing errors of the detector."""
_region_height = 0.02
_large_m2 = 4.0

Rows = NDArray[np.intp]


def robot_box(spec: RobotSpec, odometry: Odometry) -> SceneUpdate:
    """The base as a box that moves with its frame."""
    base = spec.base
    body = CubePrimitive(
        pose=pose_at((0.0, 0.0, base.height / 2)),
        size=vector((base.length, base.width, base.height)),
        color=colour(GREY, 0.9),
    )
    entity = SceneEntity(
        timestamp=time_of(odometry.stamp_ns),
        frame_id=BASE,
        id="robot",
        frame_locked=True,
        cubes=[body],
    )
    return SceneUpdate(entities=[entity])


def belief_scene(belief: MapBelief) -> SceneUpdate:
    """Seen objects with names, guessed ones the clearer the more is believed in them, places."""
    entities = [_seen(belief), _regions(belief), _trajectory(belief)]
    entities += [_guesses(belief, index) for index in range(len(belief.classes))]
    return SceneUpdate(entities=entities)


def guess_opacity(belief: MapBelief, rows: Rows) -> Floats:
    """(n,) Opacity of guessed objects: the mass of each beside that of the heaviest."""
    mass = belief.weights[belief.particle[rows]] * belief.existence[rows]
    heaviest = max(float(mass.max(initial=0.0)), 1e-12)
    return _faintest + (_strongest - _faintest) * mass / heaviest


def seen_rows(belief: MapBelief) -> Rows:
    """Rows of objects that were seen and are more than a passing error."""
    return np.flatnonzero((belief.particle == shared) & (belief.existence >= _surely_there))


def seen_opacity(belief: MapBelief, row: np.intp) -> float:
    """Places and buildings would hide what is in them."""
    length, width, _ = belief.extent[row].tolist()
    return 0.25 if length * width > _large_m2 else 0.85


def guessed_rows(belief: MapBelief, index: int) -> Rows:
    """Rows of the guessed objects of one class, the heaviest where there are many."""
    rows = np.flatnonzero((belief.particle >= 0) & (belief.class_index == index))
    mass = belief.weights[belief.particle[rows]] * belief.existence[rows]
    return rows[np.argsort(-mass, kind="stable")[:GUESSES_DRAWN]]


def region_rows(belief: MapBelief) -> Rows:
    """Rows of the places of the topology that most is believed in."""
    if not len(belief.weights):
        return np.zeros(0, np.intp)
    mass = np.bincount(belief.topology, belief.weights)
    return np.flatnonzero(belief.particle == first_topology - int(mass.argmax()))


def _seen(belief: MapBelief) -> SceneEntity:
    entity = _entity(belief, "seen")
    for row in seen_rows(belief):
        _add_cube(entity, belief, row, seen_opacity(belief, row))
        _add_name(entity, belief, row, float(belief.extent[row, 2]))
    return entity


def _regions(belief: MapBelief) -> SceneEntity:
    entity = _entity(belief, "places")
    for row in region_rows(belief):
        _add_name(entity, belief, row, _region_height)
    return entity


def _trajectory(belief: MapBelief) -> SceneEntity:
    entity = _entity(belief, "trajectory")
    way = LinePrimitive(
        type=LinePrimitive.LINE_STRIP,
        pose=pose_at((0.0, 0.0, 0.0)),
        thickness=0.03,
        points=points(on_floor(belief.trajectory[:, :2], 0.03)),
        color=colour(BLUE),
    )
    entity.lines.append(way)
    return entity


def _guesses(belief: MapBelief, index: int) -> SceneEntity:
    entity = _entity(belief, f"guessed {belief.classes[index]}")
    rows = guessed_rows(belief, index)
    for row, opacity in zip(rows, guess_opacity(belief, rows).tolist(), strict=True):
        _add_cube(entity, belief, row, opacity)
    return entity


def _entity(belief: MapBelief, name: str) -> SceneEntity:
    """Replaces the one of the same name."""
    return SceneEntity(timestamp=time_of(belief.stamp_ns), frame_id=MAP, id=name)


def _add_cube(entity: SceneEntity, belief: MapBelief, row: np.intp, opacity: float) -> None:
    x, y = belief.position[row].tolist()
    length, width, height = belief.extent[row].tolist()
    tint = class_colour(belief.classes[belief.class_index[row]])
    entity.cubes.add(
        pose=pose_at((x, y, height / 2)),
        size=vector((length, width, height)),
        color=colour(tint, opacity),
    )


def _add_name(entity: SceneEntity, belief: MapBelief, row: np.intp, height: float) -> None:
    name = belief.classes[belief.class_index[row]]
    entity.texts.append(
        TextPrimitive(
            pose=pose_at((*belief.position[row].tolist(), height + 0.2)),
            billboard=True,
            font_size=0.25,
            color=colour(class_colour(name)),
            text=f"{name} {belief.class_probability[row]:.2f}",
        )
    )
