"""A robot as data: everything the services must know about it, and nothing about how it is run."""

from dataclasses import dataclass

from robots.arm import ArmSpec
from robots.symbols import SymbolSpace
from schemas.geometry import Pose2, Pose3


@dataclass(frozen=True)
class BaseLimits:
    """What the driver enforces last, whoever commands."""

    linear_speed: float
    """[m/s]"""
    angular_speed: float
    """[rad/s]"""
    linear_acceleration: float
    """[m/s^2]"""
    angular_acceleration: float
    """[rad/s^2]"""
    command_expiry_s: float
    """The base stops when the last command is older, whatever the command says [s]."""


@dataclass(frozen=True)
class BaseGeometry:
    """The driven base."""

    length: float
    """[m]"""
    width: float
    """[m]"""
    height: float
    """Of the body, without mast [m]."""
    wheel_radius: float
    """[m]"""
    wheelbase: float
    """[m]"""
    track: float
    """[m]"""
    mass: float
    """[kg]"""
    margin: float = 0.15
    """Room kept between the footprint and anything the laser sees [m]."""
    turns_anywhere: bool = True
    """Whether ways are planned so wide that the base can turn round at every point of them; a long
    base that has to get through doors does without."""

    @property
    def radius(self) -> float:
        """Of the circle around the footprint [m]."""
        return 0.5 * (self.length**2 + self.width**2) ** 0.5

    @property
    def passage_radius(self) -> float:
        """Room that ways leave to either side [m].

        On a grid gaps look narrower than they are, by about a cell: where a base has to get through
        doors, ways are planned for a narrower one, and the last look before moving is exact.
        """
        return self.radius if self.turns_anywhere else 0.375 * self.width


@dataclass(frozen=True)
class CameraSpec:
    """An RGB-D camera."""

    width: int
    """[px]"""
    height: int
    """[px]"""
    horizontal_fov: float
    """[rad]"""
    rate_hz: float
    range_max: float
    """Depth beyond this is not trusted [m]."""
    base_from_camera: Pose3
    near: float = 1.0
    """Low objects that are closer are below the picture [m]."""
    sharp_share: float = 0.6
    """Share of `range_max` up to which objects are found as surely as they ever are."""
    blind_share: float = 1.2
    """Share of `range_max` beyond which none is found."""


@dataclass(frozen=True)
class LaserSpec:
    """A planar range finder that looks all round."""

    beams: int
    rate_hz: float
    range_min: float
    """[m]"""
    range_max: float
    """[m]"""
    base_from_laser: Pose2
    height: float
    """Above the ground [m]."""
    grid_resolution: float = 0.2
    """Side of the cells in which its scans are kept [m]. A door that is not much wider than the
    robot stays open, at any angle to the cells, only if these are small beside the difference."""


@dataclass(frozen=True)
class OdometryNoise:
    """How dead reckoning drifts; variances grow with the way."""

    variance_per_metre: float
    """[m^2/m]"""
    variance_per_radian: float
    """[rad^2/rad]"""


@dataclass(frozen=True)
class RobotSpec:
    """One kind of robot."""

    name: str
    title: str
    base: BaseGeometry
    limits: BaseLimits
    camera: CameraSpec
    laser: LaserSpec
    odometry: OdometryNoise
    symbols: SymbolSpace
    arm: ArmSpec | None = None
