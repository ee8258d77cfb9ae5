"""What the robot's sensors say."""

from typing import Annotated

from msgspec import Struct

from schemas.arrays import Bytes, Floats, Floats32, Shape, Words
from schemas.geometry import Pose2, Pose3


class Intrinsics(Struct, frozen=True, array_like=True):
    """Pinhole camera without distortion."""

    width: int
    """[px]"""
    height: int
    """[px]"""
    fx: float
    """[px]"""
    fy: float
    """[px]"""
    cx: float
    """[px], of the pixel whose centre is at (0, 0)"""
    cy: float
    """[px]"""


class RgbdFrame(Struct, frozen=True, kw_only=True):
    """One colour picture with registered depth."""

    stamp_ns: int
    """When the shutter was open."""
    color: Annotated[Bytes, Shape("H W 3")]
    """RGB, row 0 at the top."""
    depth_mm: Annotated[Words, Shape("H W")]
    """Distance along the optical axis [mm]; 0 where nothing was measured."""
    intrinsics: Intrinsics
    base_from_camera: Pose3
    odom_from_base: Pose2
    """Dead reckoning when the picture was taken."""


class WristFrame(RgbdFrame, frozen=True, kw_only=True):
    """A picture from the camera on the arm's wrist; `base_from_camera` is where it was then."""


class LaserScan(Struct, frozen=True, kw_only=True):
    """One turn of a planar range finder."""

    stamp_ns: int
    angle_min: float
    """Direction of the first beam in the laser frame [rad], counter-clockwise."""
    angle_increment: float
    """Between beams [rad]."""
    range_max: float
    """Readings at or beyond this are free space [m]."""
    ranges: Annotated[Floats32, Shape("B")]
    """[m]; infinite where nothing answered."""
    base_from_laser: Pose2
    odom_from_base: Pose2
    """Dead reckoning at the scan."""


class Odometry(Struct, frozen=True, kw_only=True):
    """Dead reckoning: smooth, and drifting."""

    stamp_ns: int
    odom_from_base: Pose2
    linear: float
    """Forward speed [m/s]."""
    angular: float
    """Yaw rate [rad/s], counter-clockwise."""
    variance_per_metre: float
    """Growth of the position variance [m^2/m]."""
    variance_per_radian: float
    """Growth of the yaw variance [rad^2/rad]."""


class JointState(Struct, frozen=True, kw_only=True):
    """Positions and speeds of every moving joint."""

    stamp_ns: int
    names: tuple[str, ...]
    positions: Annotated[Floats, Shape("J")]
    """[rad] or [m]."""
    velocities: Annotated[Floats, Shape("J")]
    """[rad/s] or [m/s]."""
