"""The wheelchair's measures and the words of the paper's second robot.

The base is a chair with driven wheels in the middle, of the size that data sheets of such chairs
give. Somebody sits in it: speeds and accelerations are those of an unhurried walk, not the
motors'. A gyroscope measures turns, so that headings drift little. Three cameras side by side
count as one that sees 120 degrees, two range finders, front and rear, as one that sees all round.
"""

import math

from robots.spec import (
    BaseGeometry,
    BaseLimits,
    CameraSpec,
    LaserSpec,
    OdometryNoise,
    RobotSpec,
)
from robots.symbols import get_symbols
from schemas.geometry import Pose2, Pose3

_looking_ahead = (0.5, -0.5, 0.5, -0.5)

WHEELCHAIR = RobotSpec(
    name="wheelchair",
    title="Powered wheelchair",
    base=BaseGeometry(
        length=1.10,
        width=0.65,
        height=0.45,
        wheel_radius=0.178,
        wheelbase=0.50,
        track=0.56,
        mass=240.0,
        margin=0.07,
        turns_anywhere=False,
    ),
    limits=BaseLimits(
        linear_speed=1.0,
        angular_speed=1.0,
        linear_acceleration=0.8,
        angular_acceleration=1.5,
        command_expiry_s=0.3,
    ),
    camera=CameraSpec(
        width=960,
        height=240,
        horizontal_fov=math.radians(120.0),
        rate_hz=5.0,
        range_max=8.0,
        base_from_camera=Pose3((0.20, 0.0, 1.10), _looking_ahead),
        near=0.5,
    ),
    laser=LaserSpec(
        beams=360,
        rate_hz=10.0,
        range_min=0.1,
        range_max=8.0,
        base_from_laser=Pose2(0.0, 0.0, 0.0),
        height=0.50,
        grid_resolution=0.1,
    ),
    odometry=OdometryNoise(variance_per_metre=1e-4, variance_per_radian=2e-5),
    symbols=get_symbols("wheelchair"),
)
