"""Where it may be worth to stand: round hypotheses, round seen things, at the edge of the seen."""

import numpy as np
from scipy import ndimage

from schemas.arrays import Floats
from schemas.geometry import Pose2
from services.policy.candidates import Candidates, Kind, looking
from services.policy.referents import Referents
from services.policy.terrain import Terrain

stand_off = 1.0
"""From the surface of the thing that is meant to the centre of the base [m]."""

_cluster = 2.0
_figure_clusters, _landmark_clusters = 6, 4
_viewing = ((0.46, (0.0, 60.0, -60.0, 120.0, -120.0, 180.0)), (0.71, (0.0,)))
"""Shares of the trusted range and directions [deg], from the near side, from which to look at a
hypothesis."""
_approaches = np.radians(np.arange(0.0, 360.0, 30.0))
_turns = np.radians(np.arange(0.0, 360.0, 45.0))
_turn_target = 3.0
_frontiers = 10
_horizon = 25.0
_spread = 2.5
_short_of = 1.5
"""A frontier is looked at from a place this far before it [m]."""
_least_area = 0.08
_middle = 1.5
"""Ground this near to the middle of a place will do for being there [m]."""
_least_opening = 0.5
"""Length of the edge of the measured ground below which nobody goes there [m]."""
_looked = 0.5
"""Probability of having missed an object, below which a block counts as looked at."""


def hypotheses(referents: Referents) -> Floats:
    """Centres (N, 2) of the heaviest clusters of what is not seen yet, figures first."""
    figure = referents.known & ~referents.figure_seen
    landmark = referents.known & ~referents.landmark_seen
    figures = _clusters(referents.figure[figure], referents.probability[figure])
    landmarks = _clusters(referents.landmark[landmark], referents.probability[landmark])
    return np.concatenate([figures[:_figure_clusters], landmarks[:_landmark_clusters]])


def views_of(centers: Floats, map_from_base: Pose2, range_max: float) -> list[Candidates]:
    """Places round each centre (N, 2) from which to look at it, and a look from here."""
    here = np.array([[map_from_base.x, map_from_base.y]])
    parts = [looking(Kind.HYPOTHESISED, centers, np.repeat(here, len(centers), axis=0))]
    for center in centers:
        for share, degrees in _viewing:
            positions = _round(center, share * range_max, np.radians(degrees), here[0])
            target = np.repeat(center[None], len(positions), axis=0)
            parts.append(looking(Kind.HYPOTHESISED, target, positions))
    return parts


def standing_at(centers: Floats, map_from_base: Pose2) -> Candidates:
    """To drive over places (N, 2): what is there comes into view on the way, or it is not there."""
    here = np.array([[map_from_base.x, map_from_base.y]])
    aimed = looking(Kind.HYPOTHESISED, centers, np.repeat(here, len(centers), axis=0))
    pose = np.column_stack([centers, aimed.pose[:, 2]])
    return Candidates(aimed.kinds, centers, pose, aimed.object_id)


def approaches(
    center: Floats,
    radius: float,
    object_id: int,
    map_from_base: Pose2,
    gap: float = stand_off,
) -> Candidates:
    """Places round a seen thing from which to declare it found, the nearest first.

    Args:
        center: (2,) of the thing, map frame [m].
        radius: of the thing [m].
        object_id: what the candidates are about.
        map_from_base: where the robot is.
        gap: from the surface of the thing [m].
    """
    here = np.array([map_from_base.x, map_from_base.y])
    positions = _round(center, radius + gap, _approaches, here)
    target = np.repeat(center[None], len(positions), axis=0)
    return looking(Kind.OBSERVED, target, positions, object_id)


def inside(
    center: Floats, object_id: int, terrain: Terrain, turning_radius: float, map_from_base: Pose2
) -> Candidates:
    """The place nearest to the middle of a seen place (2,) where the base can turn round."""
    here = np.array([map_from_base.x, map_from_base.y])
    wide = terrain.centers(*np.nonzero(terrain.known & (terrain.clearance >= turning_radius)))
    spot = _nearest_of(center[None], wide, _middle)
    return looking(Kind.OBSERVED, 2 * spot - here, spot, object_id)


def turns(map_from_base: Pose2) -> Candidates:
    """To look around from where the robot stands."""
    yaw = map_from_base.yaw + _turns[1:]
    here = np.repeat([[map_from_base.x, map_from_base.y]], len(yaw), axis=0)
    target = here + _turn_target * np.column_stack([np.cos(yaw), np.sin(yaw)])
    return looking(Kind.FRONTIER, target, here)


def frontiers(terrain: Terrain, map_from_base: Pose2, viewer: Pose2) -> Candidates:
    """Spread places at the edge of what was looked at, the nearest first.

    None is farther than `_horizon` from where the instruction was heard: open country has no end.
    """
    here = np.array([map_from_base.x, map_from_base.y])
    unlooked = terrain.unlooked > _least_area
    looked = np.asarray(ndimage.binary_dilation(terrain.missed < _looked, np.ones((3, 3))), bool)
    edge = unlooked & looked
    centers = terrain.centers(*np.nonzero(edge))
    centers = centers[np.hypot(*(centers - (viewer.x, viewer.y)).T) < _horizon]
    distance = np.hypot(*(centers - here).T)
    chosen = _spread_out(centers[np.argsort(distance, kind="stable")])
    toward = chosen - here
    length = np.maximum(np.hypot(*toward.T), 1e-9)[:, None]
    positions = here + toward * np.maximum(1 - _short_of / length, 0.0)
    return looking(Kind.FRONTIER, chosen, positions)


def openings(
    terrain: Terrain, map_from_base: Pose2, radius: float, turning_radius: float
) -> Candidates:
    """Spread places at the edge of the measured ground, the nearest first.

    Only ground counts on which a base of `radius` [m] may stand: what is unknown along a wall is
    thinner. The base goes no farther than where it can still turn round, if that is near.
    """
    here = np.array([map_from_base.x, map_from_base.y])
    open_ground = terrain.clearance >= radius
    known = terrain.known & open_ground
    unknown = ~terrain.known & open_ground
    edge = known & np.asarray(ndimage.binary_dilation(unknown, np.ones((3, 3))), bool)
    labels = np.zeros(edge.shape, np.int32)
    count = ndimage.label(edge, structure=np.ones((3, 3)), output=labels)
    assert isinstance(count, int)
    sizes = np.bincount(labels.ravel(), minlength=count + 1) * terrain.resolution
    centers = terrain.centers(*np.nonzero(edge & (sizes[labels] >= _least_opening)))
    beyond = terrain.centers(*np.nonzero(unknown))
    distance = np.hypot(*(centers - here).T)
    chosen = _spread_out(centers[np.argsort(distance, kind="stable")])
    wide = terrain.centers(*np.nonzero(terrain.known & (terrain.clearance >= turning_radius)))
    positions = _nearest_of(chosen, wide, _short_of)
    return looking(Kind.FRONTIER, chosen + _outwards(chosen, beyond), positions)


def _nearest_of(points: Floats, places: Floats, within: float) -> Floats:
    """For each of the points (N, 2) the nearest of the places (P, 2), or itself if none is near."""
    if not len(places):
        return points
    gaps = np.hypot(*(places[None] - points[:, None]).transpose(2, 0, 1))
    nearest = np.argmin(gaps, axis=1)
    near = gaps[np.arange(len(points)), nearest] < within
    return np.where(near[:, None], places[nearest], points)


def _outwards(edge: Floats, beyond: Floats) -> Floats:
    """Steps (N, 2) from the edge (N, 2) towards the middle of the points (B, 2) near to it."""
    offset = beyond[None] - edge[:, None]
    near = np.hypot(offset[..., 0], offset[..., 1]) < _spread
    mean = (offset * near[..., None]).sum(axis=1) / np.maximum(near.sum(axis=1), 1)[:, None]
    length = np.maximum(np.hypot(*mean.T), 1e-6)[:, None]
    return _short_of * mean / length


def _spread_out(centers: Floats) -> Floats:
    chosen: list[Floats] = []
    while len(centers) and len(chosen) < _frontiers:
        chosen.append(centers[0])
        centers = centers[np.hypot(*(centers - centers[0]).T) > _spread]
    return np.array(chosen).reshape(-1, 2)


def _clusters(points: Floats, weights: Floats) -> Floats:
    """Weighted means of points (N, 2) that share a square of the plane, the heaviest first."""
    if len(points) == 0:
        return np.zeros((0, 2))
    cells = np.floor(points / _cluster).astype(np.int64)
    _, cluster = np.unique(cells, axis=0, return_inverse=True)
    mass = np.bincount(cluster, weights)
    sums = [np.bincount(cluster, weights * points[:, axis]) for axis in (0, 1)]
    order = np.argsort(-mass, kind="stable")
    return (np.stack(sums, axis=-1) / mass[:, None])[order]


def _round(center: Floats, distance: float, angles: Floats, here: Floats) -> Floats:
    """Places on a circle, by angles from the side that faces `here`."""
    toward = here - center
    direction = np.arctan2(toward[1], toward[0]) + angles
    return center + distance * np.column_stack([np.cos(direction), np.sin(direction)])
