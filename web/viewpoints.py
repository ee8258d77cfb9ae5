"""Places to look at the scene from."""

import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2

VIEWPOINTS = ("Overview", "Top", "Follow")


def viewpoint(name: str, map_from_base: Pose2) -> tuple[Floats, Floats]:
    """Position and target (3,) of the viewer in the map frame [m].

    Raises:
        KeyError: the name is not in `VIEWPOINTS`.
    """
    position, target = {
        "Overview": ((-4.5, -9.0, 9.0), (3.0, 0.0, 0.0)),
        # Straight down the up direction is undefined: stay a little south.
        "Top": ((2.0, -0.1, 17.0), (2.0, 0.0, 0.0)),
        "Follow": ((-4.0, 0.0, 2.8), (3.0, 0.0, 0.3)),
    }[name]
    if name == "Overview":
        return np.array(position), np.array(target)
    return _to_map(position, map_from_base), _to_map(target, map_from_base)


def _to_map(point: tuple[float, float, float], map_from_base: Pose2) -> Floats:
    return np.array([*map_from_base.apply(np.array(point[:2])), point[2]])
