"""From a box in the picture to a box in space: place, size, direction, and how sure they are."""

import math
from dataclasses import dataclass

import numpy as np

from schemas.arrays import Floats
from schemas.sensing import Intrinsics
from services.perception.space.facing import Facing, facing_of
from services.perception.space.forms import Forms
from services.perception.space.rays import CameraRays
from services.perception.space.surface import surface_in


@dataclass(frozen=True)
class LocatedObject:
    """An object in the base frame."""

    center: Floats
    """(3,) of its box [m]."""
    covariance: Floats
    """(3, 3) of the centre [m^2]."""
    size: Floats
    """(3,) length >= width, and height, of the upright box around it [m]."""
    facing: Facing
    """Where its longer side points."""

    @property
    def extents(self) -> Floats:
        """(3,) Sizes of the box around that box along the base's axes [m]."""
        cosine, sine = abs(math.cos(self.facing.yaw)), abs(math.sin(self.facing.yaw))
        length, width, height = self.size.tolist()
        return np.array([cosine * length + sine * width, sine * length + cosine * width, height])


def locate(
    box: Floats,
    label: str,
    depth: Floats,
    rays: CameraRays,
    intrinsics: Intrinsics,
    range_max: float,
    forms: Forms,
    pixels: int | None = None,
) -> LocatedObject | None:
    """Place the object in a box (4,) x0 y0 x1 y1 [px], given a depth image (H, W) [m].

    Returns None where the object has no depth to speak of, or lies beyond `range_max` [m]: a
    detection without a place says nothing to a map. What does not matter much is placed by about
    so many `pixels` of its box.
    """
    surface = surface_in(box, depth, rays, intrinsics, range_max, pixels)
    if surface is None:
        return None
    placed = forms.place(surface, label)
    facing = facing_of(surface.points, placed.center, placed.size, surface.depth)
    return LocatedObject(placed.center, placed.covariance, placed.size, facing)
