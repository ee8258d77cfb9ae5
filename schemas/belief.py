"""The distribution over maps. It is never reduced to the best one."""

from typing import Annotated

from msgspec import Struct

from schemas.arrays import Floats, Ints, Shape, SignedBytes
from schemas.geometry import Pose2


class MapBelief(Struct, frozen=True, kw_only=True):
    """P weighted map hypotheses as columns, one row for each object of each hypothesis.

    Objects that were seen are shared by all hypotheses and stand once, with `particle` -1.
    """

    stamp_ns: int
    instruction_id: str
    """Last utterance that entered as evidence, "" for none."""
    classes: tuple[str, ...]
    """What `class_index` refers to."""
    weights: Annotated[Floats, Shape("P")]
    """Sum to one."""
    particle: Annotated[Ints, Shape("M")]
    """Hypothesis the row belongs to; -1 for objects that were seen."""
    node: Annotated[Ints, Shape("M")]
    """Object id, unique within a hypothesis; ids of seen objects stay the same for the run."""
    class_index: Annotated[Ints, Shape("M")]
    class_probability: Annotated[Floats, Shape("M")]
    """Of `class_index`."""
    position: Annotated[Floats, Shape("M 2")]
    """Map frame [m]."""
    covariance: Annotated[Floats, Shape("M 2 2")]
    """[m^2]"""
    extent: Annotated[Floats, Shape("M 3")]
    """[m]"""
    existence: Annotated[Floats, Shape("M")]
    """Probability that the object is there at all."""
    figure: Annotated[Ints, Shape("P")]
    """Object id that the utterance's figure is grounded to in each hypothesis, -1 for none."""
    landmark: Annotated[Ints, Shape("P")]
    """Likewise for its landmark."""
    viewer: Pose2
    """map_from_base when the utterance was heard: the frame of "behind" and "left"."""
    map_from_odom: Pose2
    map_from_base: Pose2
    trajectory: Annotated[Floats, Shape("X 3")]
    """Pose graph nodes x, y, yaw in the map frame."""
    effective_particles: float
    """1 / sum of squared weights."""


class OccupancyGrid(Struct, frozen=True, kw_only=True):
    """What the range finder saw, and where the camera has looked."""

    stamp_ns: int
    origin: tuple[float, float]
    """Map coordinates of the corner of cell (0, 0) [m]."""
    resolution: float
    """Cell size [m]."""
    occupancy: Annotated[SignedBytes, Shape("Y X")]
    """Log odds in tenths, positive is occupied, 0 is unknown; row is y, column is x."""
    looked: Annotated[SignedBytes, Shape("Y X")]
    """Log probability, in tenths, of missing an object here in every picture so far (<= 0)."""
