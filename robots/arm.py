"""An arm, its gripper and the camera on its wrist, as data."""

from collections.abc import Mapping
from dataclasses import dataclass

from schemas.geometry import Pose3

Six = tuple[float, float, float, float, float, float]
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class LinkShape:
    """What one link fills: a capsule, in the frame of the link."""

    link: int
    """0 is the arm's foot, 6 the flange."""
    start: Triple
    """Middle of one end [m]."""
    end: Triple
    """Middle of the other end [m]."""
    radius: float
    """[m]"""


@dataclass(frozen=True)
class ArmLimits:
    """What the driver enforces last, whoever commands. One number a joint."""

    low: Six
    """[rad]"""
    high: Six
    """[rad]"""
    speed: Six
    """[rad/s]"""
    acceleration: Six
    """[rad/s^2]"""
    torque: Six
    """[N m]"""
    command_expiry_s: float
    """The arm holds when the last command is older, whatever the command says [s]."""
    stop_s: float
    """How long the arm takes to stand still on its way after a stop, or when commands cease [s]."""
    start_tolerance: float
    """A motion must begin this near to where the joints are [rad]."""


@dataclass(frozen=True)
class GripperSpec:
    """Two parallel fingers that slide along y of the flange; z points to what they grasp."""

    opening: float
    """Widest gap between the pads [m]."""
    finger: Triple
    """Size of a finger across (x), along its slide (y) and lengthwise (z) [m]."""
    palm: Triple
    """Size of the housing that the fingers slide along, centred on the flange's axis [m]."""
    pad: float
    """The point to grasp with lies this far behind the finger tips [m]."""
    speed: float
    """Of the gap between the pads [m/s]."""
    force: float
    """Of one finger, at most [N]."""
    stiffness: float
    """How a finger pushes when something is in its way [N/m]."""

    @property
    def tip(self) -> float:
        """From the flange to the finger tips [m]."""
        return self.palm[2] + self.finger[2]

    @property
    def reach(self) -> float:
        """From the flange to the point to grasp with [m]."""
        return self.tip - self.pad


@dataclass(frozen=True)
class WristCamera:
    """An RGB-D camera that moves with the flange."""

    width: int
    """[px]"""
    height: int
    """[px]"""
    horizontal_fov: float
    """[rad]"""
    rate_hz: float
    range_max: float
    """Depth beyond this is not trusted [m]."""
    flange_from_camera: Pose3
    size: Triple
    """Of its housing: along x, y and z of the flange [m]."""


@dataclass(frozen=True)
class ArmSpec:
    """A six-axis arm; lengths and twists are Denavit and Hartenberg's.

    Frame i is turned about z of frame i-1 by the joint, then moved by `d` along z and by `a` along
    x, then turned by `alpha` about x. Frame 0 is the foot, frame 6 the flange.
    """

    joints: tuple[str, ...]
    fingers: tuple[str, str]
    a: Six
    """[m]"""
    d: Six
    """[m]"""
    alpha: Six
    """[rad]"""
    base_from_foot: Pose3
    limits: ArmLimits
    shapes: tuple[LinkShape, ...]
    """All links, without gripper and camera."""
    masses: Six
    """Of links 1 to 6; gripper and camera belong to the last [kg]."""
    gripper: GripperSpec
    camera: WristCamera
    poses: Mapping[str, Six]
    """Joint angles by name [rad]; "stow" is where the arm rests when the base drives."""

    @property
    def flange_from_tool(self) -> Pose3:
        """The tool is the point between the pads; its axes are the flange's."""
        return Pose3((0.0, 0.0, self.gripper.reach), (1.0, 0.0, 0.0, 0.0))


@dataclass(frozen=True)
class HandBox:
    """A part of the hand, a box along the flange's axes."""

    center: Triple
    """In the flange's frame [m]."""
    size: Triple
    """[m]"""


def finger_boxes(gripper: GripperSpec, opening: float) -> tuple[HandBox, HandBox]:
    """The left (+y) and the right finger with a gap between them [m]."""
    y, z = (opening + gripper.finger[1]) / 2, gripper.palm[2] + gripper.finger[2] / 2
    return HandBox((0.0, y, z), gripper.finger), HandBox((0.0, -y, z), gripper.finger)


def hand_boxes(arm: ArmSpec) -> tuple[HandBox, HandBox]:
    """The gripper's housing and the camera's, which do not move on the flange."""
    palm, camera = arm.gripper.palm, arm.camera
    return (
        HandBox((0.0, 0.0, palm[2] / 2), palm),
        HandBox(camera.flange_from_camera.position, camera.size),
    )
