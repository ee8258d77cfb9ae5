"""How much of the networks' work is saved, in pixels and not by a clock: the same in every run."""

from collections.abc import Callable

from schemas.sensing import RgbdFrame
from services.perception.detection.gaze import EVERYTHING, Gaze


class Savings:
    """Counts work since the last thing that was asked for.

    Args:
        pixels: of the networks' inputs that a look takes, given width and height of a picture [px].
    """

    def __init__(self, pixels: Callable[[int, int, Gaze], int]) -> None:
        self._pixels, self._done, self._all = pixels, 0, 0

    @property
    def share(self) -> float:
        """Of the work that was saved, in [0, 1]."""
        return 1.0 - self._done / self._all if self._all else 0.0

    def begin(self) -> None:
        """Count from here."""
        self._done = self._all = 0

    def count(self, frame: RgbdFrame, gaze: Gaze | None) -> float:
        """Share of all work that a look at a frame takes; None is no look."""
        size = frame.intrinsics.width, frame.intrinsics.height
        done, every = self._pixels(*size, gaze) if gaze else 0, self._pixels(*size, EVERYTHING)
        self._done, self._all = self._done + done, self._all + every
        return done / every
