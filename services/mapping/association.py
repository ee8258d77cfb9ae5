"""Which detection is which object: Mahalanobis distance, class, one to one."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from schemas.arrays import Floats, Ints
from services.mapping.nesting import build_of_picture, build_of_things, may_be_at_one_place
from services.mapping.objects import TrackedObject
from services.mapping.sensing import Picture

gate = 13.8
"""Squared Mahalanobis distance that one in a thousand true pairs exceeds."""
same_place = 0.6
"""Two small things are not closer than this [m]."""
_forbidden = 1e6


def match(picture: Picture, things: list[TrackedObject], containers: tuple[int, ...] = ()) -> Ints:
    """Index into `things` for each detection (N,); -1 new, -2 a second box on a known thing.

    Args:
        picture: N detections.
        things: K that are known.
        containers: indices of the classes of things that others may lie in.
    """
    found = np.full(len(picture.points), -1, np.int32)
    if not things or not len(found):
        return found
    two = may_be_at_one_place(
        build_of_picture(picture, containers), build_of_things(things, containers)
    )
    cost = np.where(two, _forbidden, _costs(picture, things))
    for i, j in zip(*linear_sum_assignment(cost), strict=True):
        if cost[i, j] < _forbidden:
            found[i] = j
    crowded = np.where(two, np.inf, _distances(picture, things)).min(axis=1) < same_place
    found[(found == -1) & crowded] = -2
    return found


def _distances(picture: Picture, things: list[TrackedObject]) -> Floats:
    means = np.array([thing.mean for thing in things])
    return np.linalg.norm(picture.points[:, None] - means[None], axis=2)


def _costs(picture: Picture, things: list[TrackedObject]) -> Floats:
    offsets = picture.points[:, None] - np.array([thing.mean for thing in things])[None]
    spread = picture.covariances[:, None] + np.array([thing.covariance for thing in things])[None]
    spread = spread + _drift(picture, things)[..., None, None] * np.eye(2)
    squared: Floats = np.einsum("ijk,ijkl,ijl->ij", offsets, np.linalg.inv(spread), offsets)
    agreement = _class_agreement(picture, things)
    distance = np.linalg.norm(offsets, axis=2)
    inside = distance < np.array([0.5 * thing.extent[:2].max() for thing in things])
    cost = 0.5 * np.minimum(squared, gate) + 0.5 * np.log(np.linalg.det(spread)) - agreement
    # Position decides first: a thing at the same place is the same thing, whatever it looks like.
    alike = agreement > np.log(0.1)
    allowed = (distance < same_place) | (alike & (inside | (squared < gate)))
    return np.where(allowed, cost, _forbidden)


def _drift(picture: Picture, things: list[TrackedObject]) -> Floats:
    """Variance (N, K) that the robot's pose gained since each thing was last seen [m^2]."""
    now = picture.uncertainty
    gained = [
        (
            max(0.0, now.position_variance - thing.seen_with.position_variance),
            max(0.0, now.yaw_variance - thing.seen_with.yaw_variance),
        )
        for thing in things
    ]
    position, yaw = np.array(gained).T
    return position + yaw * np.sum(picture.points_base**2, axis=1)[:, None]


def _class_agreement(picture: Picture, things: list[TrackedObject]) -> Floats:
    mass = picture.class_probability.sum(axis=1, keepdims=True)
    shares = picture.class_probability / np.maximum(mass, 1e-9)
    known = np.array([thing.class_probability for thing in things])
    return np.log(np.maximum(shares @ known.T, 0.01))
