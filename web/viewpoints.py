"""Places to look at the scene from."""

import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2

VIEWPOINTS = ("Overview", "Top", "Robot")


def viewpoint(name: str, map_from_base: Pose2) -> tuple[Floats, Floats]:
    """Position and target (3,) of the viewer in the map frame [m].

    Raises:
        KeyError: the name is not in `VIEWPOINTS`.
    """
    position, target = {
        "Overview": ((-4.0, -11.0, 11.0), (4.0, -0.5, 0.0)),
        # Straight down the up direction is undefined: stay a little south.
        "Top": ((2.0, -0.1, 17.0), (2.0, 0.0, 0.0)),
        "Robot": ((-4.0, 0.0, 2.8), (3.0, 0.0, 0.3)),
    }[name]
    if name == "Overview":
        return np.array(position), np.array(target)
    turned = map_from_base if name == "Robot" else Pose2(map_from_base.x, map_from_base.y, 0.0)
    return _to_map(position, turned), _to_map(target, turned)


def _to_map(point: tuple[float, float, float], map_from_viewed: Pose2) -> Floats:
    return np.array([*map_from_viewed.apply(np.array(point[:2])), point[2]])
