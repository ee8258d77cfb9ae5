"""What the arm knows of itself and of what is around it, at this moment."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator as Random

from robots.arm import ArmSpec
from robots.arm_kinematics import inverse_of, matrix
from robots.spec import RobotSpec
from schemas.arrays import Floats
from schemas.geometry import Pose2
from schemas.perception import Inspection
from services.manipulation.collision import CLEARANCE, ArmCollision, Held
from services.manipulation.holding import grip_opening
from services.manipulation.motions import free_motion
from services.manipulation.obstacles import Obstacle, own_body
from services.manipulation.straight import tool_frame
from services.manipulation.surroundings import Body, Surroundings
from services.manipulation.timing import Motion

SETTLE_NS = 200_000_000
"""A picture shows what was there after the arm came to rest only if it is so much younger."""
_here = Pose2(0.0, 0.0, 0.0)
_kept = 8
"""Pictures."""
_in_hand, _surely_in_hand = 0.30, 0.12
"""From the point between the fingers to the middle of what can be in them, where it looks like
that, and whatever it looks like: pictures come late while the arm moves [m]."""


@dataclass(frozen=True)
class Move:
    """A step: carry out a motion."""

    motion: Motion
    doing: str
    """In words, for people."""
    to_touch: bool = False
    """Whether the arm may be stopped by what it comes to touch, and that is all right."""


@dataclass(frozen=True)
class Grip:
    """A step: open or close the gripper, until the fingers rest."""

    opening: float
    """Gap to command [m]."""
    doing: str


@dataclass(frozen=True)
class Plan:
    """A step that takes the time that planning may take."""

    doing: str


@dataclass(frozen=True)
class Watch:
    """A step: wait for pictures of the wrist's camera taken from here, not for ever."""

    doing: str
    pictures: int = 3


Step = Move | Grip | Plan | Watch
Steps = Generator[Step, None, str]
"""A task: it yields steps and goes on when they are done. What it returns says how it ended; a
`RefusalError` is a failure."""


@dataclass(frozen=True)
class Picture:
    """What the wrist's camera saw at one moment."""

    stamp_ns: int
    bodies: tuple[Body, ...]
    sought: tuple[str, ...]
    """Classes that would have been recognised."""


@dataclass(frozen=True)
class Grasp:
    """What the gripper holds, and how."""

    label: str
    held: Held
    grip: float
    """Gap that is commanded [m]."""
    width: float
    """Of the thing between the fingers [m]."""


def grasp_felt(arm: ArmSpec, label: str, gap: float) -> Grasp:
    """What is known of a thing in the hand from the fingers alone, after a restart.

    It hangs upright from a hand that points down.
    """
    upright = matrix(arm.flange_from_tool) @ np.diag([1.0, -1.0, -1.0, 1.0])
    held = Held("ball", upright, np.full(3, gap))
    return Grasp(label, held, grip_opening(gap), gap)


@dataclass
class Workspace:
    """The state that tasks read; the fields are kept up to date between their steps."""

    robot: RobotSpec
    rng: Random
    surroundings: Surroundings = field(default_factory=Surroundings)
    stamp_ns: int = 0
    """Of the newest joint angles."""
    joints: Floats = field(default_factory=lambda: np.zeros(6))
    """(6,) [rad]"""
    gap: float = 0.0
    """Between the pads [m]."""
    odom_from_base: Pose2 = _here
    map_from_odom: Pose2 = _here
    grasp: Grasp | None = None
    pictures: list[Picture] = field(default_factory=list["Picture"])
    """The newest of the wrist's camera, oldest first."""
    inspection: Inspection | None = None
    """What a look into something showed, to be told."""

    @property
    def arm(self) -> ArmSpec:
        """The robot's arm; only robots with one have a workspace."""
        assert self.robot.arm is not None
        return self.robot.arm

    def see(self, seen: Sequence[Body]) -> None:
        """Remember what a picture shows, but for what the hand itself holds before the camera."""
        self.surroundings.see([body for body in seen if not self._is_in_hand(body)])

    def watch(self, picture: Picture) -> None:
        """The same for a picture of the wrist's camera, which tasks may wait for."""
        self.see(picture.bodies)
        others = tuple(body for body in picture.bodies if not self._is_in_hand(body))
        self.pictures = [*self.pictures[1 - _kept :], replace(picture, bodies=others)]

    def since(self, stamp_ns: int) -> list[Picture]:
        """Pictures of the wrist's camera that are younger."""
        return [picture for picture in self.pictures if picture.stamp_ns > stamp_ns]

    def _is_in_hand(self, body: Body) -> bool:
        if self.grasp is None:
            return False
        tool = tool_frame(self.arm, self.joints)[:3, 3]
        gap = float(np.linalg.norm(self.in_base(body)[:3, 3] - tool))
        return gap < (_in_hand if body.label == self.grasp.label else _surely_in_hand)

    def in_base(self, body: Body) -> Floats:
        """`base_from_box` (4, 4) of a body now."""
        return inverse_of(matrix(self.odom_from_base.lifted())) @ body.odom_from_box

    def around(self, without: Body | None = None) -> list[Obstacle]:
        """Everything that the arm must not touch, the robot itself among it."""
        seen = self.surroundings.obstacles(self.odom_from_base, without)
        return [*own_body(self.robot), *seen]

    def collision(self, clearance: float = CLEARANCE, opening: float | None = None) -> ArmCollision:
        """The arm, with what it holds, among everything.

        Args:
            clearance: to keep [m].
            opening: gap between the fingers, by default what it is now [m].
        """
        held = self.grasp.held if self.grasp else None
        gap = self.gap if opening is None else opening
        return ArmCollision(self.arm, self.around(), gap, held, clearance)

    def way_to(self, goals: Floats) -> Motion:
        """A motion to the nearest of postures (K, 6) that can be reached.

        Raises:
            RefusalError: as `free_motion`.
        """
        return free_motion(self.arm, self.collision(), self.joints, goals, self.rng)
