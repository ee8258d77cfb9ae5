"""How well a relation word fits a pair of things: a model of what people say.

Facts it is built on, from studies of people:
- Words for sides are best along an axis and fade with the angle to it, being neither good nor bad
  about half way to the next axis (Logan and Sadler, 1996). The angle is that of a vector sum: one
  vector to the figure from every part of the landmark, those near the figure counting most
  (Regier and Carlson, 2001). So beside a long wall much more is "in front" than beside a post.
- Sides and nearness reach farther the larger the landmark is (Carlson and Covey, 2005) and the
  wider its surroundings are, of which the nearest rivals are the measure (Kelleher and Costello,
  2009).
- "In" asks for containment; ways lead along an axis: "down" along a long thing, "past" and
  "through" to the far side, "towards" in its direction (Talmy, 1983).

Values are degrees in [0, 1]; the constants are choices, made once from these facts and not fitted
to any world that the robot is judged in.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from schemas.arrays import Flags, Floats

_worst_angle = np.radians(85.0)
_steepness = 1.5
_parts = np.stack(np.meshgrid([-0.8, 0.0, 0.8], [-0.8, 0.0, 0.8]), axis=-1).reshape(-1, 2)
"""(9, 2) of the landmark, in half boxes."""
_touching = 0.1


@dataclass(frozen=True)
class Pairs:
    """n pairs in the frame of their landmark (see `relations`)."""

    offset: Floats
    """(n, 2) u and v of the figure [m]."""
    half: Floats
    """(n, 2) half the landmark's box along u and v [m]."""
    figure_radius: Floats
    """(n,) [m]"""
    distance: Floats
    """(n,) from the viewer to the landmark [m]."""
    surroundings: Floats
    """(n,) from the landmark to its nearest rivals [m]."""
    is_open: Flags
    """(n,) whether things may lie in the landmark."""
    is_nearest: Flags
    """(n,) whether the figure is the nearest of several of its class."""

    @property
    def gap(self) -> Floats:
        """(n,) free way between the two, negative if they overlap [m]."""
        beyond = np.maximum(np.abs(self.offset) - self.half, 0.0)
        outside = np.hypot(*beyond.T)
        inside = np.max(np.abs(self.offset) - self.half, axis=1)
        return np.where(outside > 0, outside, inside) - self.figure_radius

    @property
    def reach(self) -> Floats:
        """(n,) how far the landmark's surroundings are its own [m]."""
        return 0.5 * self.surroundings + 0.8 * self.half.mean(axis=1) + 0.3

    @property
    def direction(self) -> Floats:
        """(n,) angle of the attentional vector sum, from u to v [rad]."""
        focus = np.clip(self.offset, -self.half, self.half)
        parts = _parts * self.half[:, None]
        width = np.linalg.norm(self.offset - focus, axis=1)[:, None] + _touching
        attention = np.exp(-np.linalg.norm(parts - focus[:, None], axis=2) / width)
        total = np.sum(attention[..., None] * (self.offset[:, None] - parts), axis=1)
        return np.arctan2(total[:, 1], total[:, 0])


Degree = Callable[[Pairs], Floats]


def _side(axis: float) -> Degree:
    def degree(pairs: Pairs) -> Floats:
        off = np.abs((pairs.direction - axis + np.pi) % (2 * np.pi) - np.pi)
        aligned = np.clip(1 - off / _worst_angle, 0.0, 1.0) ** _steepness
        return aligned * _apart(pairs) * np.exp(-0.5 * (pairs.gap / (2.0 * pairs.reach)) ** 2)

    return degree


def _near(pairs: Pairs) -> Floats:
    return _apart(pairs) * np.exp(-0.5 * (pairs.gap / pairs.reach) ** 2)


def _nearest(pairs: Pairs) -> Floats:
    return pairs.is_nearest * _apart(pairs) * np.exp(-pairs.gap / (3.0 * pairs.reach))


def _away(pairs: Pairs) -> Floats:
    far = pairs.gap / (3.0 * pairs.reach)
    return (1 - np.exp(-(far**2))) * np.exp(-far / 3.0)


def _inside(pairs: Pairs) -> Floats:
    margin = np.min(pairs.half - np.abs(pairs.offset), axis=1)
    return pairs.is_open * _rises(margin, 0.05 + 0.1 * pairs.half.mean(axis=1))


def _down(pairs: Pairs) -> Floats:
    depth, width = pairs.half.T
    progress = (pairs.offset[:, 0] + depth) / (2 * depth)
    beside = np.maximum(np.abs(pairs.offset[:, 1]) - width, 0.0)
    is_way = _rises(depth / width - 1.3, 0.2)
    along = _rises(progress - 0.5, 0.12) * np.exp(-np.maximum(progress - 1.0, 0.0) / 0.4)
    return is_way * along * np.exp(-0.5 * (beside / 1.5) ** 2)


def _through(pairs: Pairs) -> Floats:
    beyond = pairs.offset[:, 0] - pairs.half[:, 0]
    aside = np.abs(pairs.offset[:, 1]) / (pairs.half[:, 1] + 0.4 * np.maximum(beyond, 0.0) + 0.3)
    falls = np.exp(-0.5 * (np.maximum(beyond, 0.0) / (2.5 * pairs.reach)) ** 2)
    return pairs.is_open * _rises(beyond, 0.3) * falls * np.exp(-0.5 * aside**2)


def _past(pairs: Pairs) -> Floats:
    beyond = pairs.offset[:, 0] - pairs.half[:, 0]
    aside = np.abs(pairs.offset[:, 1]) / (pairs.half[:, 1] + 0.7 * np.maximum(beyond, 0.0) + 0.5)
    falls = np.exp(-0.5 * (np.maximum(beyond, 0.0) / (3.0 * pairs.reach)) ** 2)
    return _rises(beyond - 0.8, 0.4) * falls * np.exp(-0.5 * aside**2)


def _towards(pairs: Pairs) -> Floats:
    ahead = pairs.offset[:, 0] + pairs.distance
    off = np.abs(np.arctan2(pairs.offset[:, 1], ahead))
    share = ahead / np.maximum(pairs.distance, 0.5)
    within = _rises(share - 0.3, 0.1) * _rises(1.2 - share, 0.1)
    return within * np.exp(-0.5 * (off / np.radians(15.0)) ** 2)


def _around(pairs: Pairs) -> Floats:
    off = np.abs(pairs.direction)
    behind_a_corner = np.exp(-0.5 * ((off - np.radians(75.0)) / np.radians(30.0)) ** 2)
    large = _rises(pairs.half.mean(axis=1) - 1.0, 0.3)
    return large * behind_a_corner * _near(pairs)


def _apart(pairs: Pairs) -> Floats:
    return _rises(pairs.gap + _touching, 0.03)


def _rises(value: Floats, width: Floats | float) -> Floats:
    return 0.5 * (1 + np.tanh(value / width))


degrees: dict[str, Degree] = {
    "back": _side(0.0),
    "front": _side(np.pi),
    "left": _side(np.pi / 2),
    "right": _side(-np.pi / 2),
    "near": _near,
    "nearest": _nearest,
    "away": _away,
    "inside": _inside,
    "down": _down,
    "through": _through,
    "past": _past,
    "towards": _towards,
    "around": _around,
}
of_robot = ("back", "front", "left", "right", "near", "away")
"""Relations that people use with the robot itself as landmark."""
