"""One camera frame to everything that was recognised in it."""

import numpy as np

from schemas.perception import Detections
from schemas.sensing import RgbdFrame
from services.perception.bank import FindsObjects
from services.perception.projection import LocatedObject, locate
from services.perception.rays import camera_rays, depth_metres
from services.perception.view import ground_view


def detections_in(frame: RgbdFrame, detector: FindsObjects, range_max: float) -> Detections:
    """Detect, place, and say how far the view reached.

    Objects without a measured place within `range_max` [m] are left out, as are the parts of the
    view beyond it: a missing detection at a place means something only where the view covers it.
    """
    boxes, depth = detector.detect(frame.color), depth_metres(frame.depth_mm)
    rays = camera_rays(frame.intrinsics, frame.base_from_camera)
    places = [locate(box, depth, rays, frame.intrinsics, range_max) for box in boxes.corners_px]
    kept = [index for index, place in enumerate(places) if place is not None]
    located = [place for place in places if place is not None]
    view = ground_view(depth, frame.intrinsics, frame.base_from_camera, range_max)
    return Detections(
        stamp_ns=frame.stamp_ns,
        classes=detector.classes,
        odom_from_base=frame.odom_from_base,
        boxes_px=boxes.corners_px[kept],
        probabilities=boxes.probabilities[kept],
        scores=boxes.scores[kept],
        **_columns(located),
        view_bearings=view.bearings,
        view_ranges=view.ranges,
        view_near=view.near,
        picture_size=(frame.intrinsics.width, frame.intrinsics.height),
        # A handler reads no clock; the executor times it.
        inference_ms=0.0,
    )


def _columns(located: list[LocatedObject]) -> dict[str, np.ndarray]:
    return {
        "centers_base": np.array([place.center for place in located]).reshape(-1, 3),
        "covariances": np.array([place.covariance for place in located]).reshape(-1, 3, 3),
        "extents": np.array([place.extents for place in located]).reshape(-1, 3),
    }
