"""Writes pictures to a video file that browsers and players open."""

from collections.abc import Iterable
from pathlib import Path

import cv2

from schemas.arrays import Bytes
from schemas.errors import UserError


def write_video(pictures: Iterable[Bytes], target: Path, fps: float) -> int:
    """Write RGB pictures (H, W, 3) of one size as VP8 in WebM.

    Returns:
        Number of pictures; without any there is no file.

    Raises:
        UserError: the file cannot be written.
    """
    count, writer = 0, None
    for picture in pictures:
        writer = writer or _writer(target, fps, (picture.shape[1], picture.shape[0]))
        writer.write(cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
        count += 1
    if writer is not None:
        writer.release()
    return count


def _writer(target: Path, fps: float, size: tuple[int, int]) -> cv2.VideoWriter:
    if target.suffix != ".webm":
        raise UserError(f"{target}: a video's name ends in .webm")
    writer = cv2.VideoWriter(str(target), cv2.VideoWriter.fourcc(*"VP80"), fps, size)
    if not writer.isOpened():
        raise UserError(f"{target}: cannot be written")
    return writer
