"""One camera frame to everything that was recognised in it."""

from dataclasses import dataclass

import numpy as np

from schemas.arrays import Flags, Floats
from schemas.perception import Bodies, Detections
from schemas.sensing import RgbdFrame
from services.perception.detection.bank import FindsObjects
from services.perception.detection.boxes import Boxes
from services.perception.detection.gaze import EVERYTHING, Gaze
from services.perception.space.bodies import bodies_of
from services.perception.space.forms import Forms
from services.perception.space.projection import locate
from services.perception.space.rays import camera_rays, depth_metres
from services.perception.space.view import ground_view

Rims = tuple[Floats, Floats]
"""Left and right (D, 2) of things [m], base frame."""

_roughly = 500
"""Pixels of a box by which things are placed that nobody asks for."""
_least_wanted = 0.05
"""Probability of being something wanted from which on a thing is placed as well as can be."""


@dataclass(frozen=True)
class Look:
    """How one frame is looked at."""

    gaze: Gaze = EVERYTHING
    wanted: frozenset[str] | None = None
    """Classes that are placed as well as can be; None is all of them."""
    unsought: tuple[str, ...] = ()
    """Classes that only networks know which are not run."""
    passed: Rims | None = None
    """Of what is not looked at."""

    def matters(self, probabilities: Floats, classes: tuple[str, ...]) -> Flags:
        """(N,) Whether boxes with (N, C) may be something wanted."""
        if self.wanted is None:
            return np.ones(len(probabilities), np.bool_)
        columns = [index for index, name in enumerate(classes) if name in self.wanted]
        return probabilities[:, columns].sum(axis=1) >= _least_wanted


THOROUGH = Look()
"""All of it, and all as well as can be."""


@dataclass(frozen=True)
class Seen:
    """What was recognised in one frame; detections and bodies are the same row for row."""

    detections: Detections
    bodies: Bodies
    boxes: Boxes
    """B of them, of what could not be placed, too."""
    matters: Flags
    """(B,) Which of them may be something wanted."""


@dataclass(frozen=True)
class Recogniser:
    """Finds the objects of a frame, places them, and says how far the view reached.

    Objects without a measured place within `range_max` [m] are left out, as are the parts of the
    view beyond it: a missing detection at a place means something only where the view covers it.
    """

    detector: FindsObjects
    forms: Forms
    range_max: float

    def recognised(self, frame: RgbdFrame, look: Look = THOROUGH) -> Seen:
        """The objects of a frame, and how far one could have seen more of them."""
        boxes = self.detector.detect(frame.color, look.gaze)
        depth = depth_metres(frame.depth_mm)
        rays = camera_rays(frame.intrinsics, frame.base_from_camera)
        labels = [self.detector.classes[index] for index in boxes.classes.tolist()]
        matters = look.matters(boxes.probabilities, self.detector.classes)
        pixels = [None if one else _roughly for one in matters.tolist()]
        places = [
            locate(box, label, depth, rays, frame.intrinsics, self.range_max, self.forms, most)
            for box, label, most in zip(boxes.corners_px, labels, pixels, strict=True)
        ]
        kept = [index for index, place in enumerate(places) if place is not None]
        located = [place for place in places if place is not None]
        view = ground_view(depth, frame.intrinsics, frame.base_from_camera, self.range_max)
        view = view.without(*look.passed) if look.passed else view
        detections = Detections(
            stamp_ns=frame.stamp_ns,
            classes=self.detector.classes,
            odom_from_base=frame.odom_from_base,
            boxes_px=boxes.corners_px[kept],
            probabilities=boxes.probabilities[kept],
            scores=boxes.scores[kept],
            centers_base=np.array([place.center for place in located]).reshape(-1, 3),
            covariances=np.array([place.covariance for place in located]).reshape(-1, 3, 3),
            extents=np.array([place.extents for place in located]).reshape(-1, 3),
            view_bearings=view.bearings,
            view_ranges=view.ranges,
            view_near=view.near,
            picture_size=(frame.intrinsics.width, frame.intrinsics.height),
            # A handler reads no clock; the executor times it.
            inference_ms=0.0,
            unsought=look.unsought,
        )
        bodies = bodies_of(frame, [labels[index] for index in kept], located)
        return Seen(detections, bodies, boxes, matters)
