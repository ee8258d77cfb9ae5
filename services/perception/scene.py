"""One camera frame to everything that was recognised in it."""

from dataclasses import dataclass

import numpy as np

from schemas.perception import Bodies, Detections
from schemas.sensing import RgbdFrame
from services.perception.detection.bank import FindsObjects
from services.perception.space.bodies import bodies_of
from services.perception.space.forms import Forms
from services.perception.space.projection import locate
from services.perception.space.rays import camera_rays, depth_metres
from services.perception.space.view import ground_view


@dataclass(frozen=True)
class Recogniser:
    """Finds the objects of a frame, places them, and says how far the view reached.

    Objects without a measured place within `range_max` [m] are left out, as are the parts of the
    view beyond it: a missing detection at a place means something only where the view covers it.
    """

    detector: FindsObjects
    forms: Forms
    range_max: float

    def recognised(self, frame: RgbdFrame) -> tuple[Detections, Bodies]:
        """The objects as detections and as bodies, row for row the same."""
        boxes, depth = self.detector.detect(frame.color), depth_metres(frame.depth_mm)
        rays = camera_rays(frame.intrinsics, frame.base_from_camera)
        labels = [self.detector.classes[index] for index in boxes.classes.tolist()]
        places = [
            locate(box, label, depth, rays, frame.intrinsics, self.range_max, self.forms)
            for box, label in zip(boxes.corners_px, labels, strict=True)
        ]
        kept = [index for index, place in enumerate(places) if place is not None]
        located = [place for place in places if place is not None]
        view = ground_view(depth, frame.intrinsics, frame.base_from_camera, self.range_max)
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
        )
        return detections, bodies_of(frame, [labels[index] for index in kept], located)
