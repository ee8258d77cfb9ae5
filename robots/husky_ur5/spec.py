"""The mobile manipulator's measures and the words of the paper's third robot.

Base and arm are those of the published data sheets. The gripper takes what is up to 15 cm wide; its
fingers are long, so that the wrist stays above the rim of a box. The arm stands at the front of the
deck, the camera's mast behind it. Two range finders, front and rear, count as one that sees all
round: low enough for a box on the floor.
"""

import math
from dataclasses import replace

from robots.arm import ArmLimits, ArmSpec, GripperSpec, LinkShape, Six, WristCamera
from robots.husky.spec import HUSKY, looking_down
from robots.spec import LaserSpec, RobotSpec
from robots.symbols import get_symbols
from schemas.geometry import Pose2, Pose3

_quarter = math.pi / 2
_turn = 2 * math.pi
_lean, _half = math.radians(8.0), math.sqrt(0.5)


def _each(value: float) -> Six:
    """The same for all joints."""
    return value, value, value, value, value, value


UR5 = ArmSpec(
    joints=("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"),
    fingers=("left_finger", "right_finger"),
    a=(0.0, -0.425, -0.39225, 0.0, 0.0, 0.0),
    d=(0.089159, 0.0, 0.0, 0.10915, 0.09465, 0.0823),
    alpha=(_quarter, 0.0, 0.0, _quarter, -_quarter, 0.0),
    # Turned round, so that the arm bends forward with its first joint in the middle of its range.
    base_from_foot=Pose3((0.30, 0.0, 0.40), (0.0, 0.0, 0.0, 1.0)),
    limits=ArmLimits(
        low=_each(-_turn),
        high=_each(_turn),
        # The motors could do twice that; it is a speed at which one may stand by.
        speed=_each(1.5),
        acceleration=_each(4.0),
        torque=(150.0, 150.0, 150.0, 28.0, 28.0, 28.0),
        command_expiry_s=0.3,
        stop_s=0.4,
        start_tolerance=0.05,
    ),
    shapes=(
        LinkShape(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.04), 0.075),
        LinkShape(1, (0.0, -0.02, 0.0), (0.0, 0.0, 0.07), 0.068),
        # The upper arm runs beside the shoulder, the forearm nearly in its plane.
        LinkShape(2, (0.425, 0.0, 0.136), (0.0, 0.0, 0.136), 0.058),
        LinkShape(3, (0.0, 0.0, 0.016), (0.39225, 0.0, 0.016), 0.048),
        LinkShape(4, (0.0, -0.07, 0.0), (0.0, 0.015, 0.0), 0.044),
        LinkShape(5, (0.0, 0.06, 0.0), (0.0, -0.015, 0.0), 0.044),
        LinkShape(6, (0.0, 0.0, -0.045), (0.0, 0.0, -0.03), 0.042),
    ),
    masses=(3.7, 8.393, 2.275, 1.219, 1.219, 1.0),
    gripper=GripperSpec(
        opening=0.16,
        finger=(0.022, 0.010, 0.16),
        palm=(0.06, 0.13, 0.05),
        pad=0.02,
        speed=0.15,
        # Never reached by a grasp: saturated fingers would let go of where they are.
        force=200.0,
        stiffness=2000.0,
    ),
    camera=WristCamera(
        width=320,
        height=240,
        horizontal_fov=math.radians(69.0),
        rate_hz=5.0,
        range_max=3.0,
        # Beside the gripper, leaning by 16 degrees towards what the fingers close on, which is
        # below the middle of the picture.
        flange_from_camera=Pose3(
            (-0.075, 0.0, 0.025),
            (
                math.cos(_lean) * _half,
                -math.sin(_lean) * _half,
                math.sin(_lean) * _half,
                -math.cos(_lean) * _half,
            ),
        ),
        size=(0.03, 0.09, 0.03),
    ),
    poses={
        "stow": (0.0, -2.40, 2.30, -1.47, -_quarter, _quarter),
        # Ahead and up, the camera looking down at what lies before the robot.
        "look": (-0.28, -1.79, 1.55, -1.75, -1.45, 1.31),
        # What is held hangs before the bumper.
        "carry": (-0.45, -2.22, 2.08, -1.43, -_quarter, 1.12),
    },
)

HUSKY_UR5 = RobotSpec(
    name="husky_ur5",
    title="Clearpath Husky A200 with a UR5 arm",
    base=replace(HUSKY.base, mass=80.0),
    limits=replace(HUSKY.limits, linear_speed=0.8, angular_speed=1.0, linear_acceleration=1.0),
    camera=replace(
        HUSKY.camera, base_from_camera=Pose3((-0.30, 0.0, 1.25), looking_down(math.radians(18.0)))
    ),
    laser=LaserSpec(
        beams=360,
        rate_hz=10.0,
        range_min=0.1,
        range_max=20.0,
        base_from_laser=Pose2(0.0, 0.0, 0.0),
        height=0.16,
    ),
    odometry=HUSKY.odometry,
    symbols=get_symbols("husky_ur5"),
    arm=UR5,
)
