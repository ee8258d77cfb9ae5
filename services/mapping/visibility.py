"""Negative evidence: what a picture says about the places where it shows nothing.

Visibility is occlusion and field of view, not distance alone. Misses of successive pictures are
not independent (the same light, the same side), so each place has a floor that no number of
pictures lowers; a look from afar can rule out less than one from near.
"""

from dataclasses import dataclass

import numpy as np

from robots.spec import CameraSpec
from schemas.arrays import Flags, Floats, Floats32
from schemas.geometry import Pose2
from schemas.perception import Detections
from services.mapping.grid import Grid

detection_probability = 0.9
"""Of an object in plain view and near."""
log_floor = float(np.log(0.002))
"""No place is ever ruled out further than this."""
_edge = 0.04
"""Things at the edge of the picture are cut off [rad]."""
_shield = 0.8
"""No miss is counted this close to something that was detected, of whatever class [m]."""


@dataclass(frozen=True)
class View:
    """The part of the ground that one picture shows, base frame."""

    bearings: Floats
    """(V,) ascending [rad]."""
    ranges: Floats
    """(V,) [m]"""
    near: float
    """[m]"""
    reach: float
    """To which the camera is trusted [m]."""
    sharp_share: float = 0.6
    blind_share: float = 1.2
    """As in `CameraSpec`."""

    def detectable(self, distance: Floats) -> Floats:
        """P_D by distance: constant near, falling to zero about the end of the trusted range."""
        fall = (self.blind_share - distance / self.reach) / (self.blind_share - self.sharp_share)
        return detection_probability * np.clip(fall, 0.0, 1.0)

    def shows(self, distance: Floats, bearing: Floats) -> Flags:
        """Whether places at these polar coordinates lie in plain view."""
        if len(self.bearings) < 2:
            return np.zeros(distance.shape, np.bool_)
        after = np.clip(np.searchsorted(self.bearings, bearing), 1, len(self.bearings) - 1)
        reach = np.minimum(self.ranges[after - 1], self.ranges[after])
        wide = (bearing > self.bearings[0] + _edge) & (bearing < self.bearings[-1] - _edge)
        return wide & (distance > self.near) & (distance < reach)


def view_of(detections: Detections, camera: CameraSpec) -> View:
    """The view of a picture, and how far the camera is trusted."""
    return View(
        bearings=detections.view_bearings,
        ranges=np.nan_to_num(detections.view_ranges, posinf=1e3),
        near=detections.view_near,
        reach=camera.range_max,
        sharp_share=camera.sharp_share,
        blind_share=camera.blind_share,
    )


def look(
    grid: Grid, view: View, map_from_base: Pose2, detected: Floats, for_all: bool = True
) -> None:
    """Lower the grid's miss probabilities where the view shows bare ground.

    Args:
        grid: changed in place.
        view: of the picture.
        map_from_base: where the picture was taken.
        detected: (N, 2) positions in the base frame of everything the picture shows [m].
        for_all: whether it was searched for all classes, not only for those that are asked for.
    """
    reach = view.blind_share * view.reach
    _, distance, bearing = grid.around(map_from_base, reach)
    bare = view.shows(distance, bearing) & ~_shielded(distance, bearing, detected)
    chance = np.where(bare, view.detectable(distance), 0.0)
    floor = log_floor * chance / detection_probability
    grid.look(map_from_base, reach, _narrow(np.log1p(-chance)), _narrow(floor), for_all)


def _shielded(distance: Floats, bearing: Floats, detected: Floats) -> Flags:
    x, y = distance * np.cos(bearing), distance * np.sin(bearing)
    shielded = np.zeros(distance.shape, np.bool_)
    for center in detected:
        shielded |= (x - center[0]) ** 2 + (y - center[1]) ** 2 < _shield**2
    return shielded


def _narrow(values: Floats) -> Floats32:
    return values.astype(np.float32)
