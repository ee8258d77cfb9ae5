"""Pictures from outside: a camera device, a network stream, a video, a picture or a folder of them.

All give RGB pictures one after another. A source owns no thread and no clock: whoever asks for a
picture sets the pace, and `skip` lets one go by that nobody needs.
"""

import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from schemas.errors import MissingComponentError, UserError

PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".webp", ".tif", ".tiff")
_schemes = ("rtsp://", "rtsps://", "http://", "https://")
_patience_ms = 5000
"""How long a network stream may keep us waiting."""

Picture = NDArray[np.uint8]


class CameraSourceError(UserError):
    """What was named is no source of pictures; the message says why, and what is."""


class NoCameraError(MissingComponentError):
    """A device or a stream that gives no pictures now."""


class CameraSource(Protocol):
    """Pictures one after another."""

    def skip(self) -> bool:
        """Let one picture go by, where they come by themselves; False at the end."""
        ...

    def picture(self) -> Picture | None:
        """The next picture (H, W, 3), RGB; None at the end.

        Raises:
            CameraSourceError: there is something that is no picture.
        """
        ...

    def close(self) -> None:
        """Let go of the device or file."""
        ...


def open_source(name: str) -> CameraSource:
    """The source that a name means: a number or /dev path, an address, a file, or a folder.

    Raises:
        CameraSourceError: the name means nothing that gives pictures.
        NoCameraError: a device that is not there, or a stream that does not answer.
    """
    if name.startswith(_schemes):
        waits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, cv2.CAP_PROP_READ_TIMEOUT_MSEC]
        options = [value for wait in waits for value in (wait, _patience_ms)]
        return _Stream(name, cv2.VideoCapture(name, cv2.CAP_FFMPEG, options))
    path = Path(f"/dev/video{name}" if name.isdigit() else name)
    if path.is_dir():
        return _Folder(_pictures_in(path))
    if path.suffix.lower() in PICTURES and path.is_file():
        return _Folder([path])
    if str(path).startswith("/dev/"):
        return _device(path)
    if not path.is_file():
        raise CameraSourceError(
            f"no pictures from {name!r}: no such file; a source is the number of a camera, "
            "/dev/videoN, an rtsp:// or http:// address, a video, a picture, or a folder of them "
            f"({', '.join(PICTURES)})"
        )
    return _Stream(name, cv2.VideoCapture(str(path), cv2.CAP_FFMPEG))


class _Stream:
    """Whatever OpenCV's video reader opens."""

    def __init__(self, name: str, capture: cv2.VideoCapture) -> None:
        self._name, self._capture = name, capture
        if not capture.isOpened():
            _refuse_stream(name)
        # A camera must not hand out what it saw a while ago; not all drivers obey.
        capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)

    def skip(self) -> bool:
        return bool(self._capture.grab())

    def picture(self) -> Picture | None:
        found, picture = self._capture.read()
        if not found:
            return None
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), np.uint8)

    def close(self) -> None:
        self._capture.release()


class _Folder:
    """Picture files in the order of their names."""

    def __init__(self, paths: list[Path]) -> None:
        self._left: Iterator[Path] = iter(paths)

    def skip(self) -> bool:
        # Files wait.
        return True

    def picture(self) -> Picture | None:
        path = next(self._left, None)
        return None if path is None else read_picture(path)

    def close(self) -> None:
        self._left = iter(())


def read_picture(path: Path) -> Picture:
    """An RGB picture (H, W, 3) from a file; grey ones get three equal channels.

    Raises:
        CameraSourceError: the file is missing, cut short or of an encoding that is not known.
    """
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR_RGB)
    if picture is None:
        raise CameraSourceError(
            f"cannot read {path} as a picture: the file is missing, damaged, or of another "
            f"encoding than {', '.join(PICTURES)}"
        )
    return np.asarray(picture, np.uint8)


def _pictures_in(folder: Path) -> list[Path]:
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in PICTURES)
    if not paths:
        raise CameraSourceError(
            f"no pictures in {folder}: files there must be {', '.join(PICTURES)}"
        )
    return paths


def _device(path: Path) -> CameraSource:
    if not (path.exists() and stat.S_ISCHR(path.stat().st_mode)):
        there = ", ".join(sorted(str(one) for one in Path("/dev").glob("video*"))) or "none"
        raise NoCameraError(f"no camera at {path}; cameras here are: {there}")
    return _Stream(str(path), cv2.VideoCapture(str(path), cv2.CAP_V4L2))


def _refuse_stream(name: str) -> None:
    if name.startswith(_schemes):
        raise NoCameraError(f"no pictures from {name}: nothing answers there within 5 s")
    if name.startswith("/dev/"):
        raise NoCameraError(f"the camera {name} does not open: another program may hold it")
    raise CameraSourceError(
        f"cannot read {name} as a video: it is damaged or of an encoding that FFmpeg does not know"
    )
