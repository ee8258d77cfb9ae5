"""Small parts of Foxglove's messages out of ours."""

from collections.abc import Iterable
from functools import cache
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp

from robots.colours import Rgb
from schemas.arrays import Floats
from schemas.geometry import Pose3

MAP, ODOM, BASE, CAMERA, LASER = "map", "odom", "base", "camera", "laser"
"""Names of the frames, as in `schemas.geometry`."""


def time_of(stamp_ns: int) -> Timestamp:
    """The same time."""
    return Timestamp(seconds=stamp_ns // 1_000_000_000, nanos=stamp_ns % 1_000_000_000)


def vector(xyz: Floats | Iterable[float]) -> Vector3:
    """(3,) as a vector."""
    x, y, z = np.asarray(xyz, np.float64).tolist()
    return Vector3(x=x, y=y, z=z)


def points(xyz: Floats) -> list[Point3]:
    """(N, 3) as points."""
    return [Point3(x=x, y=y, z=z) for x, y, z in xyz.tolist()]


def rotation(wxyz: tuple[float, float, float, float]) -> Quaternion:
    """Scalar first as scalar last."""
    w, x, y, z = wxyz
    return Quaternion(x=x, y=y, z=z, w=w)


def pose(of: Pose3) -> Pose:
    """The same pose."""
    return Pose(position=vector(of.position), orientation=rotation(of.wxyz))


def pose_at(xyz: Floats | Iterable[float]) -> Pose:
    """A pose that is not turned."""
    return Pose(position=vector(xyz), orientation=Quaternion(w=1.0))


def colour(rgb: Rgb, opacity: float = 1.0) -> Color:
    """A colour of bytes; `opacity` in [0, 1]."""
    red, green, blue = (part / 255 for part in rgb)
    return Color(r=red, g=green, b=blue, a=opacity)


def on_floor(xy: Floats, height: float) -> Floats:
    """(N, 2) as (N, 3) at a height [m]."""
    return np.column_stack([xy, np.full(len(xy), height)])


@cache
def schema_of(kind: type[Message]) -> tuple[str, bytes]:
    """Full name of a type of messages, and all files that define it, for an MCAP schema."""
    files: dict[str, Any] = {}
    _collect(kind.DESCRIPTOR.file, files)
    descriptors = FileDescriptorSet()
    for file in files.values():
        file.CopyToProto(descriptors.file.add())
    return kind.DESCRIPTOR.full_name, descriptors.SerializeToString()


def _collect(file: Any, files: dict[str, Any]) -> None:
    """Add a file after all that it depends on."""
    if file.name not in files:
        for needed in file.dependencies:
            _collect(needed, files)
        files[file.name] = file
