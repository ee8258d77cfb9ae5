"""The distribution over maps. It is never reduced to the best one."""

from typing import Annotated

import numpy as np
from msgspec import Struct

from schemas.arrays import Flags, Floats, Ints, Shape, SignedBytes
from schemas.geometry import Pose2

shared = -1
"""`MapBelief.particle` of seen objects."""
first_topology = -2
"""`MapBelief.particle` of the regions of topology 0; those of later ones count down."""


class MapBelief(Struct, frozen=True, kw_only=True):
    """P weighted map hypotheses as columns, one row for each object of each hypothesis.

    What was seen is not repeated: objects are shared by all hypotheses and stand once, with
    `particle` -1; regions of places are shared by the hypotheses that divide the places alike,
    which have the same topology k, and stand once with `particle` -2 - k.
    """

    stamp_ns: int
    instruction_id: str
    """Last utterance that entered as evidence, "" for none."""
    classes: tuple[str, ...]
    """What `class_index` refers to."""
    weights: Annotated[Floats, Shape("P")]
    """Sum to one."""
    particle: Annotated[Ints, Shape("M")]
    """Hypothesis the row belongs to; negative for what was seen, see above."""
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
    figure_class: Annotated[Ints, Shape("P")]
    """What the figure is in each hypothesis, an index of `classes`, -1 for none: what was said,
    whatever the object looks most like."""
    landmark_class: Annotated[Ints, Shape("P")]
    """Likewise for its landmark."""
    topology: Annotated[Ints, Shape("P")]
    """Topology of each hypothesis."""
    node_regions: Annotated[Ints, Shape("K X")]
    """Of each topology: id of the region (`node`) that each pose of the trajectory lies in; no
    rows where places are not divided."""
    region_edges: Annotated[Ints, Shape("E 3")]
    """Topology and the ids of two regions that one can go between."""
    viewer: Pose2
    """map_from_base when the utterance was heard: the frame of "behind" and "left"."""
    map_from_odom: Pose2
    map_from_base: Pose2
    trajectory: Annotated[Floats, Shape("X 3")]
    """Pose graph nodes x, y, yaw in the map frame."""
    effective_particles: float
    """1 / sum of squared weights."""

    @property
    def seen(self) -> Flags:
        """(M,) Rows of what was seen; the others are hypothesised."""
        return self.particle < 0

    def rows_of(self, hypothesis: int) -> Flags:
        """(M,) Rows of one hypothesis: what it imagines, its regions, and all seen objects."""
        regions = first_topology - self.topology[hypothesis]
        # Once for each particle of each belief: ten times faster than `np.isin`.
        return (
            (self.particle == hypothesis) | (self.particle == shared) | (self.particle == regions)
        )

    def row_of(self, hypothesis: Ints, node: Ints) -> Ints:
        """Rows (n,) of nodes (n,) in hypotheses (n,); -1 where a hypothesis has no such node."""
        keys = zip(self.particle.tolist(), self.node.tolist(), strict=True)
        table = {key: row for row, key in enumerate(keys)}
        regions = first_topology - self.topology[hypothesis]
        owners = (hypothesis.tolist(), [shared] * len(node), regions.tolist())
        rows = [
            next((table[owner, one] for owner in them if (owner, one) in table), -1)
            for one, *them in zip(node.tolist(), *owners, strict=True)
        ]
        return np.array(rows, np.int32)


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
    looked_for_all: bool = True
    """Whether `looked` holds for objects of every class, or for what is asked for alone."""
