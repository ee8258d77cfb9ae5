"""What the robot is about to do: every choice with its cost, the goal and the way there."""

from collections.abc import Iterable

import numpy as np
from foxglove_schemas_protobuf.ArrowPrimitive_pb2 import ArrowPrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneEntityDeletion_pb2 import SceneEntityDeletion
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.TextPrimitive_pb2 import TextPrimitive

from robots.colours import GREEN, ORANGE, SKY, Rgb
from schemas.geometry import Pose3
from schemas.task import Decision, Goal, GoalStatus, InstructionStatus, TaskState
from services.recorder.viewer.parts import (
    MAP,
    colour,
    on_floor,
    points,
    pose,
    pose_at,
    time_of,
    vector,
)

CANDIDATES_DRAWN = 40
_costs_written = 8
_dear: Rgb = (68, 1, 84)
_cheap: Rgb = (253, 231, 37)


def candidates(decision: Decision) -> SceneUpdate:
    """Places that the robot may go to: the cheapest are yellow, the chosen one is the largest."""
    entity = SceneEntity(timestamp=time_of(decision.stamp_ns), frame_id=MAP, id="candidates")
    order = np.argsort(decision.costs, kind="stable")[:CANDIDATES_DRAWN]
    span = max(float(np.ptp(decision.costs[order])) if len(order) else 0.0, 1e-9)
    for rank, row in enumerate(order.tolist()):
        at = (*decision.positions[row].tolist(), 0.1)
        cheapness = 1.0 - (decision.costs[row] - decision.costs[order[0]]) / span
        size = 0.4 if row == decision.chosen else 0.2
        entity.spheres.append(
            SpherePrimitive(
                pose=pose_at(at), size=vector((size,) * 3), color=colour(_between(float(cheapness)))
            )
        )
        if rank < _costs_written or row == decision.chosen:
            text = f"{decision.kinds[row]} {decision.costs[row]:.1f}"
            entity.texts.append(_text(at, text))
    return SceneUpdate(entities=[entity])


def goal(to: Goal) -> SceneUpdate:
    """An arrow where the robot wants to be."""
    flat = to.map_from_goal.lifted()
    raised = Pose3((flat.position[0], flat.position[1], 0.15), flat.wxyz)
    arrow = ArrowPrimitive(
        pose=pose(raised),
        shaft_length=0.5,
        shaft_diameter=0.08,
        head_length=0.25,
        head_diameter=0.2,
        color=colour(GREEN),
    )
    entity = SceneEntity(timestamp=time_of(to.stamp_ns), frame_id=MAP, id="goal", arrows=[arrow])
    return SceneUpdate(entities=[entity])


def path(status: GoalStatus) -> SceneUpdate:
    """The rest of the planned way."""
    line = LinePrimitive(
        type=LinePrimitive.LINE_STRIP,
        pose=pose_at((0.0, 0.0, 0.0)),
        thickness=0.06,
        points=points(on_floor(status.path, 0.05)),
        color=colour(ORANGE),
    )
    entity = SceneEntity(timestamp=time_of(status.stamp_ns), frame_id=MAP, id="path", lines=[line])
    return SceneUpdate(entities=[entity])


def over(status: InstructionStatus) -> Iterable[SceneUpdate]:
    """What an instruction drew is taken away when it has ended."""
    if status.state is not TaskState.ACTIVE:
        everything = SceneEntityDeletion(
            timestamp=time_of(status.stamp_ns), type=SceneEntityDeletion.ALL
        )
        yield SceneUpdate(deletions=[everything])


def _text(at: tuple[float, ...], text: str) -> TextPrimitive:
    x, y, z = at
    return TextPrimitive(
        pose=pose_at((x, y, z + 0.3)),
        billboard=True,
        font_size=0.2,
        color=colour(SKY),
        text=text,
    )


def _between(cheapness: float) -> Rgb:
    red, green, blue = (
        round(dear + cheapness * (cheap - dear)) for dear, cheap in zip(_dear, _cheap, strict=True)
    )
    return red, green, blue
