"""The lens of a camera that is not simulated, and pictures as frames that perception takes."""

import math
from pathlib import Path

import cv2
import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from schemas.errors import UserError
from schemas.geometry import Pose2, Pose3
from schemas.sensing import Intrinsics, RgbdFrame

_distortion_counts = (0, 4, 5, 8)


class LensError(UserError):
    """A calibration file cannot be used; the message says what in it."""


class Lens(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Intrinsics of a camera as calibration gives them, for pictures of one size."""

    width: int
    """[px]"""
    height: int
    """[px]"""
    fx: float
    """[px]"""
    fy: float
    """[px]"""
    cx: float
    """[px], of the pixel whose centre is at (0, 0)"""
    cy: float
    """[px]"""
    distortion: tuple[float, ...] = ()
    """Coefficients k1, k2, p1, p2, then k3, then k4, k5, k6 of OpenCV's model."""


def read_lens(path: Path) -> Lens:
    """Read a calibration file.

    Raises:
        LensError: it is missing or malformed.
    """
    try:
        lens = msgspec.json.decode(path.read_bytes(), type=Lens)
    except (OSError, msgspec.DecodeError) as error:
        raise LensError(
            f"cannot read a calibration from {path}: {error}; an example: "
            '{"width": 640, "height": 480, "fx": 600, "fy": 600, "cx": 319.5, "cy": 239.5, '
            '"distortion": [0.1, -0.2, 0, 0, 0]}'
        ) from error
    if min(lens.width, lens.height, lens.fx, lens.fy) <= 0:
        raise LensError(f"{path}: width, height, fx and fy are more than 0")
    if len(lens.distortion) not in _distortion_counts:
        raise LensError(
            f"{path}: {len(lens.distortion)} distortion coefficients; allowed are 0, 4, 5 or 8"
        )
    return lens


def supposed_lens(width: int, height: int, horizontal_fov: float) -> Lens:
    """A lens without distortion, from the angle that it sees [rad]."""
    focal = width / 2 / math.tan(horizontal_fov / 2)
    return Lens(
        width=width, height=height, fx=focal, fy=focal, cx=(width - 1) / 2, cy=(height - 1) / 2
    )


class Framing:
    """Makes frames of pictures: of one size, without distortion, and with no depth.

    Args:
        lens: of the camera; it fits pictures of its own proportions, at any scale.
        base_from_camera: where the camera is.
        widest: pictures with more columns are made smaller [px].
    """

    def __init__(self, lens: Lens, base_from_camera: Pose3, widest: int) -> None:
        self._lens, self._base_from_camera = lens, base_from_camera
        self._widest = widest

    def frame(self, picture: NDArray[np.uint8], stamp_ns: int) -> RgbdFrame:
        """The frame of an RGB picture (H, W, 3).

        Raises:
            LensError: the picture has other proportions than those the lens was calibrated for.
        """
        picture, lens = self._fitted(picture)
        if lens.distortion:
            matrix = np.array([[lens.fx, 0, lens.cx], [0, lens.fy, lens.cy], [0, 0, 1]])
            straight = cv2.undistort(picture, matrix, np.array(lens.distortion))
            picture = np.asarray(straight, np.uint8)
        return RgbdFrame(
            stamp_ns=stamp_ns,
            color=picture,
            depth_mm=np.zeros(picture.shape[:2], np.uint16),
            intrinsics=Intrinsics(lens.width, lens.height, lens.fx, lens.fy, lens.cx, lens.cy),
            base_from_camera=self._base_from_camera,
            odom_from_base=Pose2(0.0, 0.0, 0.0),
        )

    def _fitted(self, picture: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], Lens]:
        height, width = picture.shape[:2]
        if abs(width * self._lens.height - height * self._lens.width) > 0.01 * width * height:
            raise LensError(
                f"a picture of {width}x{height} px does not fit a lens calibrated for "
                f"{self._lens.width}x{self._lens.height}: the proportions differ"
            )
        wide = min(width, self._widest)
        size = (wide, round(height * wide / width))
        if size != (width, height):
            resized = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
            picture = np.asarray(resized, np.uint8)
        return picture, _scaled(self._lens, *size)


def _scaled(lens: Lens, width: int, height: int) -> Lens:
    """The lens for pictures of another size."""
    x, y = width / lens.width, height / lens.height
    return msgspec.structs.replace(
        lens,
        width=width,
        height=height,
        fx=lens.fx * x,
        fy=lens.fy * y,
        # Pixel centres are at whole numbers, edges half a pixel away.
        cx=(lens.cx + 0.5) * x - 0.5,
        cy=(lens.cy + 0.5) * y - 0.5,
    )
