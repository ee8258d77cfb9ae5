"""What the robot recognised in what it sensed."""

from typing import Annotated

from msgspec import Struct

from schemas.arrays import Floats, Ints, Shape
from schemas.geometry import Pose2


class Detections(Struct, frozen=True, kw_only=True):
    """Objects seen in one frame, before any association; N may be zero, which is evidence too."""

    stamp_ns: int
    """Of the frame."""
    classes: tuple[str, ...]
    """Names of the C classes the detector looked for."""
    odom_from_base: Pose2
    """Dead reckoning at the frame."""
    boxes_px: Annotated[Floats, Shape("N 4")]
    """x0 y0 x1 y1 in the picture."""
    probabilities: Annotated[Floats, Shape("N C")]
    """Calibrated class distribution of each box; a row sums to at most 1, the rest is `none`."""
    scores: Annotated[Floats, Shape("N")]
    """Detector confidence in [0, 1]; not a calibrated probability."""
    centers_base: Annotated[Floats, Shape("N 3")]
    """Object centres in the base frame [m]."""
    covariances: Annotated[Floats, Shape("N 3 3")]
    """Of `centers_base` [m^2]."""
    extents: Annotated[Floats, Shape("N 3")]
    """Sizes of upright boxes around the objects, along the base's axes [m]."""
    view_bearings: Annotated[Floats, Shape("V")]
    """Directions in the base frame in which the camera looked, ascending [rad]."""
    view_ranges: Annotated[Floats, Shape("V")]
    """How far the ground was seen in each direction before something hid it [m]."""
    view_near: float
    """Closer than this the camera does not see the ground [m]."""
    picture_size: tuple[int, int]
    """Width and height of the picture the boxes lie in [px]."""
    inference_ms: float
    """Time the network took [ms]; 0 in lockstep, where time is modelled."""
    unsought: tuple[str, ...] = ()
    """Those of `classes` that this look did not attend to: what shows none of them says nothing
    about them. The view counts for the others alone."""


class Focus(Struct, frozen=True, kw_only=True):
    """What perception attends to, told once for every camera frame, looked at or not."""

    stamp_ns: int
    """Of the frame."""
    wanted: tuple[str, ...]
    """Classes that the instruction needs; all where it cannot be narrowed, none without one."""
    seen_ns: int
    """Stamp of the frame whose `Detections` hold now; that of this frame if it was looked at."""
    reason: str
    """Why this frame was not looked at, in words; "" where it was."""
    unsought: tuple[str, ...]
    """Classes that were not attended to in it."""
    regions_px: Annotated[Ints, Shape("R 4")]
    """x0 y0 x1 y1 of the parts of the picture that were looked at, or that held so far."""
    passed_px: Annotated[Ints, Shape("Q 4")]
    """x0 y0 x1 y1 of things that a moment ago showed nothing wanted, and were passed over."""
    work: float
    """Of the networks in this frame, as a share of all of them on the whole picture."""
    saved: float
    """Share of the networks' work that was saved since the instruction came, in [0, 1]."""


class Bodies(Struct, frozen=True, kw_only=True):
    """The objects of one frame as bodies in space; row for row those of `Detections`.

    Every object has an upright box around it: x along its longer horizontal side, y along the
    shorter one, z up, the origin in its middle. Solids are the simple shapes that it consists of.
    """

    stamp_ns: int
    """Of the frame, as of the `Detections` that the rows belong to."""
    odom_from_base: Pose2
    """Dead reckoning at the frame."""
    positions_base: Annotated[Floats, Shape("N 3")]
    """Middles of the boxes in the base frame [m]."""
    wxyz_base: Annotated[Floats, Shape("N 4")]
    """Rotations of the boxes in the base frame, unit quaternions, scalar first. Half a turn about
    z means the same."""
    covariances: Annotated[Floats, Shape("N 6 6")]
    """Of x, y, z [m^2] and of small turns about the base's x, y, z [rad^2]."""
    sizes: Annotated[Floats, Shape("N 3")]
    """Of the boxes: length, width, height [m]."""
    solid_rows: Annotated[Ints, Shape("S")]
    """Row of the object that each solid belongs to."""
    solid_kinds: Annotated[Ints, Shape("S")]
    """Index into `SOLID_KINDS`."""
    solid_centers: Annotated[Floats, Shape("S 3")]
    """In the frame of the object's box [m]; solids are turned as the box is."""
    solid_sizes: Annotated[Floats, Shape("S 3")]
    """Of a box; diameter twice and height of a cylinder; diameter three times of a ball [m]."""


SOLID_KINDS = ("box", "cylinder", "ball")


class Inspection(Struct, frozen=True, kw_only=True):
    """What a look into an open thing showed; to have found nothing in it is evidence too."""

    stamp_ns: int
    """Of the picture."""
    odom_from_base: Pose2
    """Dead reckoning at the picture."""
    label: str
    """Class of the thing that was looked into."""
    center_base: Annotated[Floats, Shape("2")]
    """Its middle in the base frame [m]."""
    seen: float
    """Share of its floor that was in view, in [0, 1]."""
    sought: tuple[str, ...]
    """Classes that would have been recognised."""
    found: tuple[str, ...]
    """Classes of the things that lie in it, one for each thing."""


class SceneObservation(Struct, frozen=True, kw_only=True):
    """What kinds of places one frame shows, from image-based scene classification or from tags.

    A classifier of the whole picture speaks of one point; tags and patches of places that are seen
    from afar speak of points ahead.
    """

    stamp_ns: int
    """Of the frame."""
    types: tuple[str, ...]
    """Names of the T types of places that it tells apart."""
    odom_from_base: Pose2
    """Dead reckoning at the frame."""
    points_base: Annotated[Floats, Shape("N 2")]
    """Where the places are that were classified; (0, 0) is where the robot stands [m]."""
    probabilities: Annotated[Floats, Shape("N T")]
    """Calibrated type distribution of each point under even odds; a row sums to 1."""


class Fiducials(Struct, frozen=True, kw_only=True):
    """Square tags of a known size that one frame shows, and where they are.

    A tag's frame has its origin in the middle, +x to the right and +y up as one looks at it, and +z
    out of it, towards whoever looks.
    """

    stamp_ns: int
    """Of the frame."""
    family: str
    """Which codes the tags bear."""
    odom_from_base: Pose2
    """Dead reckoning at the frame."""
    ids: Annotated[Ints, Shape("N")]
    """Numbers of the tags in their family."""
    corners_px: Annotated[Floats, Shape("N 4 2")]
    """In the picture: upper left, upper right, lower right, lower left as the tag is read."""
    positions_base: Annotated[Floats, Shape("N 3")]
    """Middles of the tags in the base frame [m]."""
    wxyz_base: Annotated[Floats, Shape("N 4")]
    """Orientations `base_from_tag`, unit quaternions, scalar first."""
    covariances: Annotated[Floats, Shape("N 6 6")]
    """Of position [m] and of a small turn about the base's axes [rad], in this order."""
