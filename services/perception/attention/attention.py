"""Which frames are looked at, for which classes, where: the plan for each picture.

A wanted class is looked for in all of a picture that is new. What is not wanted, and what a moment
ago showed nothing wanted, is looked at once in a while, since a thing found along the way is
remembered for the next instruction. A picture that shows what the last one did is not looked at
again before its result has grown old; the better a view is known, the longer it holds. Time is
that of the frames, never that of a clock.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from schemas.arrays import Flags, Floats, Ints
from schemas.geometry import Pose2
from schemas.sensing import RgbdFrame
from services.perception.attention.dull import NOTHING_DULL, Dull
from services.perception.attention.regions import Shapes, shapes_in
from services.perception.attention.sameness import View, view_in

SECOND_NS = 1_000_000_000
_holds_ns = 200_000_000
"""How long a result holds for each time the same view was looked at."""
_oldest_ns = SECOND_NS
"""Age at which nothing holds any more: things may go that leave the picture as it was."""
_seldom_ns = SECOND_NS
"""How often what nobody asks for is looked at."""


@dataclass(frozen=True)
class Plan:
    """What is done with one frame."""

    looks: bool
    reason: str
    """Why it is not looked at, in words; "" where it is."""
    wanted: frozenset[str]
    networks: frozenset[int]
    """Numbers of those that are run."""
    unsought: tuple[str, ...]
    """Classes that only other networks know."""
    shapes: Shapes | None
    """Where anything can be; None is anywhere."""
    passed: Shapes | None
    """What stands there, too, and is passed over."""

    @property
    def regions(self) -> Ints | None:
        """(R, 4) Parts of the picture that are looked at [px]; None is all of it."""
        return None if self.shapes is None else self.shapes.regions_px


class Attention:
    """Plans frame by frame; remembers what was looked at and when.

    Args:
        groups: classes of each network.
        range_max: as far as depth is trusted [m].
    """

    def __init__(self, groups: Sequence[Sequence[str]], range_max: float) -> None:
        self._groups, self._range_max = [frozenset(group) for group in groups], range_max
        self._classes = tuple(dict.fromkeys(name for group in groups for name in group))
        self._wanted: frozenset[str] = frozenset()
        self._view: View | None = None
        self._looks = 0
        self._dull: Dull = NOTHING_DULL
        self._all_ns: int | None = None
        self._last: Plan | None = None
        self.seen_ns = 0
        """Stamp of the frame that was looked at last."""

    def want(self, wanted: frozenset[str]) -> bool:
        """Attend to classes; if they are others than before, with a full look at once.

        Returns:
            Whether they are.
        """
        changed = wanted != self._wanted
        if changed:
            self._wanted = wanted
            self.forget()
        return changed

    def forget(self) -> None:
        """Begin again: nothing that was seen holds any more."""
        self._view, self._all_ns, self._last = None, None, None

    def plan(self, frame: RgbdFrame) -> Plan:
        """What to do with a frame; the next plan takes it as done."""
        view, age_ns = view_in(frame, self._range_max), frame.stamp_ns - self.seen_ns
        same = self._view is not None and view.shows_same(self._view)
        reason = self._reason_to_hold(same, age_ns)
        if reason and self._last:
            return self._held(self._last, reason)
        self._looks = self._looks + 1 if same else 1
        self._view, self.seen_ns = view, frame.stamp_ns
        self._last = self._look(frame)
        return self._last

    def note(self, corners_px: Floats, wanted: Flags, odom_from_base: Pose2) -> None:
        """Take up what the last plan has led to.

        Args:
            corners_px: (N, 4) boxes that were found [px].
            wanted: (N,) which of them may be something wanted.
            odom_from_base: dead reckoning at the frame.
        """
        looked_at = self._last.shapes if self._last else None
        if looked_at is not None:
            dull = ~_touched(looked_at.boxes_px, corners_px[wanted])
            self._dull = self._dull.with_these(looked_at.selected(dull), odom_from_base)

    def _reason_to_hold(self, same: bool, age_ns: int) -> str:
        """Why a frame need not be looked at, "" if it has to be."""
        if self._last is None or age_ns < 0:
            return ""
        ago = f"{age_ns / SECOND_NS:.1f} s ago"
        if same and age_ns < min(self._looks * _holds_ns, _oldest_ns):
            return f"same view as {ago}"
        if not self._wanted and age_ns < _seldom_ns:
            return f"nothing is asked for, looked {ago}"
        return ""

    def _look(self, frame: RgbdFrame) -> Plan:
        shapes = shapes_in(frame, self._range_max)
        if shapes is None or self._all_due(frame.stamp_ns):
            self._dull = NOTHING_DULL
            return self._plan(frozenset(range(len(self._groups))), shapes, None)
        dull = self._dull.known(shapes, frame.odom_from_base)
        networks = frozenset(k for k, known in enumerate(self._groups) if known & self._wanted)
        return self._plan(networks, shapes.selected(~dull), shapes.selected(dull))

    def _all_due(self, stamp_ns: int) -> bool:
        """Whether it is time to look at everything for everything."""
        since_ns = None if self._all_ns is None else stamp_ns - self._all_ns
        due = not self._wanted or since_ns is None or not 0 <= since_ns < _seldom_ns
        if due:
            self._all_ns = stamp_ns
        return due

    def _plan(self, networks: frozenset[int], shapes: Shapes | None, passed: Shapes | None) -> Plan:
        known = frozenset[str]().union(*(self._groups[k] for k in networks))
        unsought = tuple(name for name in self._classes if name not in known)
        return Plan(True, "", self._wanted, networks, unsought, shapes, passed)

    def _held(self, last: Plan, reason: str) -> Plan:
        parts = (last.wanted, last.networks, last.unsought, last.shapes, last.passed)
        return Plan(False, reason, *parts)


def _touched(boxes: Ints, corners: Floats) -> Flags:
    """(R,) Which boxes (R, 4) overlap with any of some others (N, 4)."""
    low = np.maximum(boxes[:, None, :2], corners[:, :2])
    high = np.minimum(boxes[:, None, 2:], corners[:, 2:])
    overlap: Flags = np.all(low < high, axis=2)
    return np.asarray(np.any(overlap, axis=1), np.bool_)
