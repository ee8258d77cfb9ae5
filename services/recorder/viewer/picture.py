"""What the camera sees: compressed pictures, the lens, and boxes around what was found."""

import io

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.Point2_pb2 import Point2
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from foxglove_schemas_protobuf.TextAnnotation_pb2 import TextAnnotation
from PIL import Image

from robots.colours import class_colour
from schemas.perception import Detections
from schemas.sensing import RgbdFrame
from services.recorder.viewer.parts import CAMERA, colour, time_of

JPEG_QUALITY = 85


def image(frame: RgbdFrame) -> CompressedImage:
    """The colour picture as JPEG. The exact one stays in the message that it was made of."""
    out = io.BytesIO()
    Image.fromarray(frame.color).save(out, "JPEG", quality=JPEG_QUALITY)
    return CompressedImage(
        timestamp=time_of(frame.stamp_ns), frame_id=CAMERA, data=out.getvalue(), format="jpeg"
    )


def calibration(frame: RgbdFrame) -> CameraCalibration:
    """A lens without distortion."""
    lens = frame.intrinsics
    fx, fy, cx, cy = lens.fx, lens.fy, lens.cx, lens.cy
    return CameraCalibration(
        timestamp=time_of(frame.stamp_ns),
        frame_id=CAMERA,
        width=lens.width,
        height=lens.height,
        distortion_model="plumb_bob",
        D=[0.0] * 5,
        K=[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        R=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        P=[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


def boxes(found: Detections) -> ImageAnnotations:
    """Boxes with the likeliest class of each."""
    drawn = ImageAnnotations()
    best = found.probabilities.argmax(axis=1).tolist() if len(found.scores) else []
    for box, row, index in zip(found.boxes_px.tolist(), found.probabilities, best, strict=True):
        name, (x0, y0, x1, y1) = found.classes[index], box
        tint = colour(class_colour(name))
        corners = [Point2(x=x, y=y) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
        drawn.points.append(
            PointsAnnotation(
                timestamp=time_of(found.stamp_ns),
                type=PointsAnnotation.LINE_LOOP,
                points=corners,
                outline_color=tint,
                thickness=2.0,
            )
        )
        drawn.texts.append(
            TextAnnotation(
                timestamp=time_of(found.stamp_ns),
                position=Point2(x=x0, y=y0),
                text=f"{name} {row[index]:.2f}",
                font_size=12.0,
                text_color=tint,
                background_color=colour((0, 0, 0), 0.5),
            )
        )
    return drawn
