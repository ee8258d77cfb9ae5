"""What the range finder sees, and the floor as it was mapped."""

import numpy as np
from foxglove_schemas_protobuf.Grid_pb2 import Grid
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan as LaserScanView
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.Vector2_pb2 import Vector2

from schemas.arrays import Bytes
from schemas.belief import OccupancyGrid
from schemas.sensing import LaserScan
from services.recorder.viewer.parts import LASER, MAP, pose_at, time_of

_floor, _wall, _looked = (225, 228, 232), (40, 44, 52), (86, 180, 233)


def scan(turn: LaserScan) -> LaserScanView:
    """The same beams."""
    last = turn.angle_min + turn.angle_increment * (len(turn.ranges) - 1)
    return LaserScanView(
        timestamp=time_of(turn.stamp_ns),
        frame_id=LASER,
        pose=pose_at((0.0, 0.0, 0.0)),
        start_angle=turn.angle_min,
        end_angle=last,
        ranges=turn.ranges.astype(np.float64),
    )


def grid(of: OccupancyGrid) -> Grid:
    """Colours of cells: walls dark, floor light, looked-at floor blue, the unknown clear."""
    rows, columns = of.occupancy.shape
    fields = [
        PackedElementField(name=name, offset=offset, type=PackedElementField.UINT8)
        for offset, name in enumerate(("red", "green", "blue", "alpha"))
    ]
    return Grid(
        timestamp=time_of(of.stamp_ns),
        frame_id=MAP,
        pose=pose_at((*of.origin, 0.0)),
        column_count=columns,
        cell_size=Vector2(x=of.resolution, y=of.resolution),
        row_stride=4 * columns,
        cell_stride=4,
        fields=fields,
        data=grid_colours(of).tobytes() if rows else b"",
    )


def grid_colours(of: OccupancyGrid) -> Bytes:
    """(Y, X, 4) RGBA of the cells."""
    colours = np.zeros((*of.occupancy.shape, 4), np.uint8)
    free = of.occupancy < 0
    colours[free] = (*_floor, 255)
    # Each picture that shows nothing here makes it less likely that something was missed.
    seen = np.clip(of.looked[free].astype(np.float64) / -20.0, 0.0, 0.6)[:, None]
    mixed = (1 - seen) * np.array(_floor) + seen * np.array(_looked)
    colours[free, :3] = mixed.round().astype(np.uint8)
    colours[of.occupancy > 0] = (*_wall, 255)
    return colours
