"""The comparative: that no other thing of the figure's class stands nearer to the landmark.

Every candidate counts by the probability that it is one: a thing that was seen by its class, its
existence and the doubt of its place; things that nobody saw by how many of the class stand on
ground that nobody looked at. So where the disc round the landmark was not looked at, the
comparative is in doubt, and looking there is what settles it.
"""

import numpy as np
from scipy.special import ndtr

from schemas.arrays import Floats, Ints
from services.mapping.objects import ObjectColumns

_mistaken = 0.01
"""Probability that a person calls a thing the nearest although another one is nearer."""
_least_deviation = 0.1
"""People do not tell smaller differences [m]."""
_count = 24
_disc = np.sqrt((np.arange(_count) + 0.5) / _count)[:, None] * np.stack(
    [
        np.cos(np.pi * (3 - np.sqrt(5)) * np.arange(_count)),
        np.sin(np.pi * (3 - np.sqrt(5)) * np.arange(_count)),
    ],
    axis=1,
)
"""(24, 2) evenly in the unit disc, in the manner of a sunflower."""


def log_no_seen_rival(
    landmark: Floats,
    own: Floats,
    variance: Floats,
    partners: Ints,
    class_index: int,
    objects: ObjectColumns,
) -> Floats:
    """Log probability (P,) that none of the things that were seen stands nearer.

    Args:
        landmark: (P, 2), map frame [m].
        own: (P,) from landmark to figure [m].
        variance: (P,) of the figure's place, in each direction [m^2].
        partners: (P, 2) ids of figure and landmark, which are no rivals.
        class_index: of the figure.
        objects: what was seen.
    """
    chance = np.exp(objects.class_log[:, class_index]) * objects.existence
    gaps = np.linalg.norm(landmark[:, None] - objects.mean, axis=2)
    spread = np.trace(objects.covariance, axis1=1, axis2=2) / 2 + variance[:, None]
    nearer = ndtr((own[:, None] - gaps) / np.sqrt(spread + _least_deviation**2))
    other = (partners[:, :, None] != objects.number).all(axis=1)
    return np.log1p(-(1 - _mistaken) * chance * nearer * other).sum(axis=1)


def disc_round(landmark: Floats, own: Floats) -> Floats:
    """Places (P, 24, 2) evenly in the discs in which a rival would be nearer."""
    return landmark[:, None] + own[:, None, None] * _disc


def log_no_unseen_rival(own: Floats, log_unseen: Floats, density: float) -> Floats:
    """Log probability (P,) that nothing nearer stands where nobody looked.

    Args:
        own: (P,) from landmark to figure [m].
        log_unseen: (P, 24) of `disc_round`, of having missed a thing there.
        density: of things of the figure's class [1/m^2].
    """
    unlooked = np.pi * own**2 * np.mean(np.exp(log_unseen), axis=1)
    return np.logaddexp(np.log1p(-_mistaken) - density * unlooked, np.log(_mistaken))
