"""Whether the arm touches anything: capsules and boxes on its links against what stands around."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import fcl
import numpy as np

from robots.arm import ArmSpec, finger_boxes, hand_boxes
from robots.arm_kinematics import link_frames, matrix
from schemas.arrays import Floats
from services.manipulation.obstacles import Obstacle

CLEARANCE = 0.012
"""That a free motion keeps from everything [m]."""
_flange = 6


@dataclass(frozen=True)
class _Moving:
    """A shape on a link."""

    name: str
    link: int
    link_from_shape: Floats
    body: Any


@dataclass(frozen=True)
class Held:
    """What the gripper holds, as one shape on the flange."""

    kind: str
    """One of `SOLID_KINDS`."""
    flange_from_shape: Floats
    """(4, 4)"""
    size: Floats
    """(3,) [m]"""


class ArmCollision:
    """The arm with a given gap between its fingers, among obstacles that stand still.

    Neighbouring links overlap by design and are not tested against each other.

    Args:
        arm: whose links.
        obstacles: in the frame of the base.
        opening: gap between the pads [m].
        held: what is in the gripper.
        clearance: by how much all links are thickened [m].
    """

    def __init__(
        self,
        arm: ArmSpec,
        obstacles: Sequence[Obstacle],
        opening: float,
        held: Held | None = None,
        clearance: float = CLEARANCE,
    ) -> None:
        self._arm = arm
        self._base_from_foot = matrix(arm.base_from_foot)
        self._around = [(o.name, _still(o)) for o in obstacles]
        self._moving = [
            *_links(arm, clearance),
            *_hand(arm, opening, clearance),
            *([_carried(held, clearance)] if held else []),
        ]
        foot = [m for m in self._moving if m.link < 2]
        # Pairs of groups that may meet; the shoulder is where it is, whatever the joints do.
        self._pairs = (
            (_managed([body for _, body in self._around]), self._from_link(2)),
            (_managed([m.body for m in foot]), self._from_link(3)),
            (_managed([m.body for m in self._moving if m.link == 2]), self._from_link(4)),
        )

    def _from_link(self, first: int) -> Any:
        return _managed([m.body for m in self._moving if m.link >= first])

    def free(self, joints: Floats) -> bool:
        """Whether nothing touches at joint angles (6,) [rad]."""
        self._move(joints)
        return not any(_meet(still, moving) for still, moving in self._pairs)

    def free_along(self, path: Floats) -> bool:
        """Whether nothing touches at any of the points (K, 6) [rad]."""
        return all(self.free(joints) for joints in path)

    def clearance(self, joints: Floats) -> float:
        """From the thickened arm to the nearest thing around; 0 if they touch [m]."""
        self._move(joints)
        around, moving = self._pairs[0]
        data = fcl.DistanceData()
        around.distance(moving, data, fcl.defaultDistanceCallback)
        return max(0.0, float(data.result.min_distance))

    def touching(self, joints: Floats) -> str:
        """What touches what, in words; empty if nothing does."""
        self._move(joints)
        outer = [m for m in self._moving if m.link >= 2]
        for moving in outer:
            for name, body in self._around:
                if _touch(moving.body, body):
                    return f"the {moving.name} touches the {name}"
        inner = [m for m in self._moving if m.link < 4]
        for one in inner:
            for other in outer:
                apart = other.link >= max(3, one.link + 2)
                if apart and one.link < 3 and _touch(one.body, other.body):
                    return f"the {other.name} touches the {one.name}"
        return ""

    def _move(self, joints: Floats) -> None:
        frames = self._base_from_foot @ link_frames(self._arm, joints)
        for moving in self._moving:
            place = frames[moving.link] @ moving.link_from_shape
            moving.body.setTransform(fcl.Transform(place[:3, :3], place[:3, 3]))
        for still, outer in self._pairs:
            still.update()
            outer.update()


def _links(arm: ArmSpec, clearance: float) -> list[_Moving]:
    names = ("arm's foot", "shoulder", "upper arm", "forearm", "wrist", "wrist", "wrist")
    made: list[_Moving] = []
    for shape in arm.shapes:
        start, end = np.array(shape.start), np.array(shape.end)
        place = _along_z(end - start)
        place[:3, 3] = (start + end) / 2
        length = float(np.linalg.norm(end - start))
        capsule = fcl.Capsule(shape.radius + clearance, length)
        made.append(_Moving(names[shape.link], shape.link, place, fcl.CollisionObject(capsule)))
    return made


def _hand(arm: ArmSpec, opening: float, clearance: float) -> list[_Moving]:
    boxes = (*hand_boxes(arm), *finger_boxes(arm.gripper, opening))
    names = ("gripper", "wrist camera", "finger", "finger")
    made: list[_Moving] = []
    for name, one in zip(names, boxes, strict=True):
        place = np.eye(4)
        place[:3, 3] = one.center
        body = fcl.CollisionObject(fcl.Box(*(side + 2 * clearance for side in one.size)))
        made.append(_Moving(name, _flange, place, body))
    return made


def _carried(held: Held, clearance: float) -> _Moving:
    body = fcl.CollisionObject(_shape(held.kind, held.size + 2 * clearance))
    return _Moving("thing in the gripper", _flange, held.flange_from_shape, body)


def _still(obstacle: Obstacle) -> Any:
    place = obstacle.base_from_shape
    transform = fcl.Transform(place[:3, :3], place[:3, 3])
    return fcl.CollisionObject(_shape(obstacle.kind, obstacle.size), transform)


def _shape(kind: str, size: Floats) -> Any:
    x, y, z = size.tolist()
    if kind == "box":
        return fcl.Box(x, y, z)
    return fcl.Sphere(x / 2) if kind == "ball" else fcl.Cylinder((x + y) / 4, z)


def _managed(bodies: list[Any]) -> Any:
    manager = fcl.DynamicAABBTreeCollisionManager()
    manager.registerObjects(bodies)
    manager.setup()
    return manager


def _meet(some: Any, others: Any) -> bool:
    data = fcl.CollisionData()
    some.collide(others, data, fcl.defaultCollisionCallback)
    return bool(data.result.is_collision)


def _touch(one: Any, other: Any) -> bool:
    return bool(fcl.collide(one, other, fcl.CollisionRequest(), fcl.CollisionResult()))


def _along_z(direction: Floats) -> Floats:
    """A frame (4, 4) at the origin whose z is a direction (3,)."""
    z = direction / np.linalg.norm(direction)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    made = np.eye(4)
    made[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return made
