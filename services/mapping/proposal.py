"""Fresh hypotheses from the posterior: importance sampling in four disjoint strata.

Figure and landmark are each either a thing that was seen or a new one (Section "Modifying the
graph based on natural language"). Pairs of seen things are enumerated; new figures are drawn from
the relation, new landmarks from the prior or, when the figure is known, from the relation turned
round. Every row carries log target - log proposal, so that strata compare fairly.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from schemas.arrays import Floats, Ints
from services.mapping import prior, relations
from services.mapping.annotations import Reading
from services.mapping.even import EvenPoints
from services.mapping.particles import (
    Particles,
    hypothesised_figure,
    hypothesised_landmark,
    joined,
    nothing,
)
from services.mapping.prior import Meant
from services.mapping.target import (
    Evidence,
    log_target,
    placed,
    relation_features,
    relation_frame,
)

_possible = np.log(0.02)
"""Things less likely of the class are not tried."""
_oversampling = 16
"""Proposals for each hypothesis that is kept, where nothing was seen yet."""
_beside_seen = 4
"""Likewise where figure or landmark was seen."""
_least = 32
_turned_round = 0.7
"""A proposal must be wider than what it proposes for [m]."""


@dataclass(frozen=True)
class _Draw:
    """One stratum: hypotheses and the log of their number times the density they come from."""

    figure: Ints
    figure_position: Floats
    landmark: Ints
    landmark_position: Floats
    log_proposal: Floats


def fresh_particles(count: int, evidence: Evidence, points: EvenPoints) -> Particles:
    """Weighted hypotheses, more than `count`, that are one sample of the posterior.

    The same points propose the same places again, whatever was seen meanwhile.
    """
    blocks: list[Particles] = []
    for number, reading in enumerate(evidence.readings):
        share = max(_least, round(count * np.exp(reading.log_probability)))
        for draw in _strata(reading, share, evidence, points):
            blocks.append(_weighted(draw, number, evidence))
    pool = joined(blocks)
    return pool.weighted(pool.log_weight)


def _weighted(draw: _Draw, reading: int, evidence: Evidence) -> Particles:
    count = len(draw.figure)
    bare = Particles(
        log_weight=np.zeros(count),
        reading=np.full(count, reading, np.int32),
        figure=draw.figure,
        landmark=draw.landmark,
        figure_position=draw.figure_position,
        landmark_position=draw.landmark_position,
        topology=np.zeros(count, np.int32),
    )
    block = placed(bare, evidence.objects)
    return replace(block, log_weight=log_target(block, evidence) - draw.log_proposal)


def _strata(reading: Reading, share: int, evidence: Evidence, points: EvenPoints) -> list[_Draw]:
    figures = _candidates(reading.figure, evidence)
    figures = figures[~np.isin(figures, reading.not_meant)]
    many = points.first(_oversampling * share)
    if reading.relation is None:
        return [_seen(figures, _no_one(figures)), _new_alone(reading, many, evidence)]
    if reading.landmark is None:
        return [_beside_robot(figures, evidence), _new_beside_robot(reading, many, evidence)]
    landmarks = _candidates(reading.landmark, evidence)
    pairs = np.array(np.meshgrid(figures, landmarks), np.int32).reshape(2, -1)
    draws = [_seen(pairs[0], pairs[1]), _all_new(reading, many, evidence)]
    if len(landmarks):
        each = points.first(max(_least, _beside_seen * share // len(landmarks)))
        draws.append(_near_seen_landmark(reading, landmarks, each, evidence))
    if len(figures):
        each = points.first(max(_least, _beside_seen * share // len(figures)))
        draws.append(_near_seen_figure(reading, figures, each, evidence))
    return draws


def _candidates(class_index: int, evidence: Evidence) -> Ints:
    return evidence.objects.number[evidence.objects.class_log[:, class_index] > _possible]


def _no_one(like: Ints) -> Ints:
    return np.full(len(like), nothing, np.int32)


def _seen(figures: Ints, landmarks: Ints) -> _Draw:
    zeros = np.zeros((len(figures), 2))
    return _Draw(figures, zeros, landmarks, zeros, np.zeros(len(figures)))


def _beside_robot(figures: Ints, evidence: Evidence) -> _Draw:
    places = _at_viewer(len(figures), evidence)
    zeros = np.zeros((len(figures), 2))
    return _Draw(figures, zeros, _no_one(figures), places, np.zeros(len(figures)))


def _new_beside_robot(reading: Reading, points: Floats, evidence: Evidence) -> _Draw:
    count = len(points)
    alone, density = np.full(count, nothing, np.int32), np.full(count, np.log(count))
    return _new_figure(
        reading, alone, _at_viewer(count, evidence), density, points[:, :3], evidence
    )


def _new_alone(reading: Reading, points: Floats, evidence: Evidence) -> _Draw:
    role = evidence.meant_as("figure", reading.figure)
    places, log_proposal = _new_places(role, points, evidence)
    new = np.full(len(points), hypothesised_figure, np.int32)
    return _Draw(new, places, _no_one(new), np.zeros(places.shape), log_proposal)


def _all_new(reading: Reading, points: Floats, evidence: Evidence) -> _Draw:
    role = evidence.meant_as("landmark", reading.landmark)
    places, log_proposal = _new_places(role, points, evidence)
    new = np.full(len(points), hypothesised_landmark, np.int32)
    return _new_figure(reading, new, places, log_proposal, points[:, 3:], evidence)


def _new_places(role: Meant, points: Floats, evidence: Evidence) -> tuple[Floats, Floats]:
    """Places (n, 2) from the prior, and log density (n,) times count."""
    places = prior.places_at(role, points[:, :3], evidence.viewer)
    return places, prior.log_place(role, places, evidence.viewer) + np.log(len(points))


def _near_seen_landmark(
    reading: Reading, landmarks: Ints, points: Floats, evidence: Evidence
) -> _Draw:
    numbers = np.repeat(landmarks, len(points))
    counts = np.full(len(numbers), np.log(len(points)))
    cube = np.tile(points[:, :3], (len(landmarks), 1))
    return _new_figure(reading, numbers, _where(numbers, evidence), counts, cube, evidence)


def _new_figure(
    reading: Reading,
    landmark: Ints,
    places: Floats,
    log_proposal: Floats,
    points: Floats,
    evidence: Evidence,
) -> _Draw:
    """Figures drawn from the relation around landmarks (n, 2), which have their own density."""
    assert reading.relation is not None
    new = np.full(len(places), hypothesised_figure, np.int32)
    frame = relation_frame(reading, places, evidence.viewer)
    phi = relation_features(reading, frame, new, landmark, evidence)
    offset = reading.relation.sample(points, frame, phi)
    density = reading.relation.log_density(frame, offset, phi, 0.0)
    return _Draw(new, places + offset, landmark, places, log_proposal + density)


def _near_seen_figure(reading: Reading, figures: Ints, points: Floats, evidence: Evidence) -> _Draw:
    """Landmarks drawn from the relation turned round, in the frame at the figure."""
    assert reading.relation is not None
    numbers = np.repeat(figures, len(points))
    cube = np.tile(points, (len(figures), 1))
    places = _where(numbers, evidence)
    new = np.full(len(numbers), hypothesised_landmark, np.int32)
    frame = relations.frame_at(places, evidence.viewer)
    phi = relation_features(reading, frame, numbers, new, evidence)
    # The frame belongs at the landmark, which is not known yet: blur makes up for the difference.
    blur = _turned_round * ndtri(cube[:, 3:5])
    offset = reading.relation.sample(cube[:, :3], frame, phi) + blur
    density = reading.relation.log_density(frame, offset, phi, _turned_round**2)
    return _Draw(numbers, places, new, places - offset, density + np.log(len(points)))


def _at_viewer(count: int, evidence: Evidence) -> Floats:
    return np.tile([evidence.viewer.x, evidence.viewer.y], (count, 1))


def _where(numbers: Ints, evidence: Evidence) -> Floats:
    rows = np.argmax(numbers[:, None] == evidence.objects.number[None], axis=1)
    return evidence.objects.mean[rows]
