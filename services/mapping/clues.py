"""What a further relation says about a thing, whatever the third thing is that it names.

"The hydrant behind the cone ... the hydrant is near the building": the building is no part of the
hypotheses. Its place is summed out, over the buildings that were seen and over places drawn once
from the prior for one that was not, so that weights do not jitter from picture to picture.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2
from services.mapping import prior, relations
from services.mapping.even import EvenPoints
from services.mapping.objects import ObjectColumns
from services.mapping.prior import Meant
from services.mapping.relations import Frame, Relation

_places = 64
_imprecise = np.log(0.05)
"""Probability that a person got the relation wrong."""


@dataclass(frozen=True)
class Clue:
    """One relation between a thing of the reading and a third thing."""

    relation: Relation
    of_figure: bool
    """Whether it is about the reading's figure; about its landmark otherwise."""
    other: int | None
    """Class index of the third thing; None for the robot itself."""
    other_is_landmark: bool
    """Whether the third thing is the landmark of the relation; its figure otherwise."""
    figure_radius: float
    """Typical of the relation's figure [m]."""
    landmark_radius: float
    """And of its landmark [m]."""


def unseen_places(viewer: Pose2) -> Floats:
    """Places (n, 2), map frame, where a third thing that was not seen may stand."""
    return viewer.apply(_standard_places())


def log_factor(
    clue: Clue,
    role: Meant,
    anchors: Floats,
    objects: ObjectColumns,
    log_missed: Floats,
    viewer: Pose2,
) -> Floats:
    """Log of p(anchor | clue) / p(anchor), for things of the reading at `anchors` (P, 2).

    Args:
        clue: the relation.
        role: in which the things are meant, which decides p(anchor).
        anchors: map frame [m].
        objects: what was seen.
        log_missed: of `unseen_places` (n,): log probability that nothing there was overlooked.
        viewer: map_from_base when it was said.
    """
    if clue.other is None:
        here = np.array([viewer.x, viewer.y])
        density = _density(clue, anchors - here, relations.frame_of_robot(viewer, len(anchors)))
    else:
        places, log_weight = _third_things(clue.other, objects, log_missed, viewer)
        pairs = _pairs(clue, anchors, places, viewer)
        density = np.logaddexp.reduce(pairs + log_weight, axis=1)
    said = density - prior.log_place(role, anchors, viewer)
    return np.logaddexp(np.log1p(-np.exp(_imprecise)) + said, _imprecise)


def _third_things(
    other: int, objects: ObjectColumns, log_missed: Floats, viewer: Pose2
) -> tuple[Floats, Floats]:
    """Places (n, 2) of the third thing, and the log of their probabilities (n,)."""
    seen = objects.class_log[:, other] + np.log(objects.existence)
    seen = (
        seen + prior.log_place("landmark", objects.mean, viewer) - np.log(prior.background_density)
    )
    log_weight = np.concatenate([seen, log_missed - np.log(len(log_missed))])
    places = np.concatenate([objects.mean, unseen_places(viewer)])
    return places, log_weight - np.logaddexp.reduce(log_weight)


def _pairs(clue: Clue, anchors: Floats, places: Floats, viewer: Pose2) -> Floats:
    """Log density (P, n) of the relation between every anchor and every place."""
    shape = (len(anchors), len(places), 2)
    anchor = np.broadcast_to(anchors[:, None], shape).reshape(-1, 2)
    place = np.broadcast_to(places, shape).reshape(-1, 2)
    figure, landmark = (anchor, place) if clue.other_is_landmark else (place, anchor)
    frame = relations.frame_at(landmark, viewer)
    return _density(clue, figure - landmark, frame).reshape(shape[:2])


def _density(clue: Clue, offset: Floats, frame: Frame) -> Floats:
    figure_radius = np.full(len(offset), clue.figure_radius)
    phi = relations.features_of(frame, figure_radius, np.full(offset.shape, clue.landmark_radius))
    return clue.relation.log_density(frame, offset, phi, relations.residual**2)


@cache
def _standard_places() -> Floats:
    """In the frame of the viewer."""
    points = EvenPoints(np.random.default_rng(0)).first(_places)
    return prior.places_at("landmark", points[:, :3], Pose2(0.0, 0.0, 0.0))
