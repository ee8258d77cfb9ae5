"""The Husky's measures (published data sheet) and the words of the paper's first robot."""

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
from schemas.geometry import Pose2, Pose3, quaternion_product

_camera_pitch = math.radians(8.0)
_optical_from_level = (0.5, -0.5, 0.5, -0.5)
"""Rotation of an optical frame that looks along +x of the base."""


def looking_down(pitch: float) -> tuple[float, float, float, float]:
    """Rotation of an optical frame that looks ahead and down by an angle [rad]."""
    about_y = (math.cos(pitch / 2), 0.0, math.sin(pitch / 2), 0.0)
    return quaternion_product(about_y, _optical_from_level)


HUSKY = RobotSpec(
    name="husky",
    title="Clearpath Husky A200",
    base=BaseGeometry(
        length=0.99,
        width=0.67,
        height=0.39,
        wheel_radius=0.1651,
        wheelbase=0.512,
        track=0.5708,
        mass=56.0,
    ),
    limits=BaseLimits(
        linear_speed=1.0,
        angular_speed=1.5,
        linear_acceleration=2.0,
        angular_acceleration=4.0,
        command_expiry_s=0.3,
    ),
    camera=CameraSpec(
        width=320,
        height=240,
        horizontal_fov=math.radians(69.0),
        rate_hz=5.0,
        range_max=7.0,
        base_from_camera=Pose3((0.25, 0.0, 0.92), looking_down(_camera_pitch)),
    ),
    laser=LaserSpec(
        beams=360,
        rate_hz=10.0,
        range_min=0.1,
        range_max=20.0,
        base_from_laser=Pose2(0.30, 0.0, 0.0),
        height=0.45,
    ),
    odometry=OdometryNoise(variance_per_metre=2.5e-4, variance_per_radian=4e-4),
    symbols=get_symbols("husky"),
)
