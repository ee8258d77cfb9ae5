"""Where the frames are, all of them at once, so that a viewer may begin anywhere."""

from collections.abc import Iterable

from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms

from robots.spec import RobotSpec
from schemas.belief import MapBelief
from schemas.geometry import Pose2, Pose3
from schemas.sensing import LaserScan, Odometry, RgbdFrame
from services.recorder.viewer.parts import (
    BASE,
    CAMERA,
    LASER,
    MAP,
    ODOM,
    rotation,
    time_of,
    vector,
)


class Frames:
    """The newest pose of each frame in its parent."""

    def __init__(self, spec: RobotSpec) -> None:
        self._laser_height = spec.laser.height
        self._children: dict[str, tuple[str, Pose3]] = {
            ODOM: (MAP, Pose2(0.0, 0.0, 0.0).lifted()),
            BASE: (ODOM, Pose2(0.0, 0.0, 0.0).lifted()),
            CAMERA: (BASE, spec.camera.base_from_camera),
            LASER: (BASE, self._raised(spec.laser.base_from_laser)),
        }

    def on_belief(self, belief: MapBelief) -> Iterable[FrameTransforms]:
        """The drift of the odometry is corrected."""
        self._children[ODOM] = (MAP, belief.map_from_odom.lifted())
        return ()

    def on_odometry(self, odometry: Odometry) -> FrameTransforms:
        """The robot has moved: all frames, at the odometry's rate."""
        self._children[BASE] = (ODOM, odometry.odom_from_base.lifted())
        return self._all(odometry.stamp_ns)

    def on_picture(self, frame: RgbdFrame) -> Iterable[FrameTransforms]:
        """The camera may be on an arm."""
        self._children[CAMERA] = (BASE, frame.base_from_camera)
        return ()

    def on_scan(self, scan: LaserScan) -> Iterable[FrameTransforms]:
        """The laser is where its scan says."""
        self._children[LASER] = (BASE, self._raised(scan.base_from_laser))
        return ()

    def _raised(self, base_from_laser: Pose2) -> Pose3:
        flat = base_from_laser.lifted()
        return Pose3((flat.position[0], flat.position[1], self._laser_height), flat.wxyz)

    def _all(self, stamp_ns: int) -> FrameTransforms:
        return FrameTransforms(
            transforms=[
                FrameTransform(
                    timestamp=time_of(stamp_ns),
                    parent_frame_id=parent,
                    child_frame_id=child,
                    translation=vector(pose.position),
                    rotation=rotation(pose.wxyz),
                )
                for child, (parent, pose) in self._children.items()
            ]
        )
