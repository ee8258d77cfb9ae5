"""Fresh hypotheses from the posterior: importance sampling in four disjoint strata.

Figure and landmark are each either a thing that was seen or a new one (Section "Modifying the
graph based on natural language"). Pairs of seen things are enumerated; new figures are drawn from
the relation, new landmarks from the prior or, when the figure is known, from the relation turned
round. Every row carries log target - log proposal, so that strata compare fairly.
"""

from dataclasses import dataclass, replace

import numpy as np

from schemas.arrays import Floats, Ints
from services.mapping import prior, relations
from services.mapping.annotations import Reading
from services.mapping.particles import (
    Particles,
    hypothesised_figure,
    hypothesised_landmark,
    joined,
    nothing,
)
from services.mapping.target import (
    Evidence,
    log_target,
    missed,
    placed,
    relation_features,
    relation_frame,
)

_possible = np.log(0.02)
"""Things less likely of the class are not tried."""
_oversampling = 8
_least = 20
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


def fresh_particles(count: int, evidence: Evidence, rng: np.random.Generator) -> Particles:
    """Weighted hypotheses, more than `count`, that are one sample of the posterior."""
    blocks: list[Particles] = []
    for number, reading in enumerate(evidence.readings):
        share = max(_least, round(2 * count * np.exp(reading.log_probability)))
        for draw in _strata(reading, share, evidence, rng):
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


def _strata(
    reading: Reading, share: int, evidence: Evidence, rng: np.random.Generator
) -> list[_Draw]:
    figures = _candidates(reading.figure, evidence)
    if reading.relation is None:
        return [_seen(figures, _no_one(figures)), _new_alone(reading, share, evidence, rng)]
    if reading.landmark is None:
        places = np.tile([evidence.viewer.x, evidence.viewer.y], (share, 1))
        alone = np.full(share, nothing, np.int32)
        count = np.full(share, np.log(share))
        beside = _new_figure(reading, alone, places, count, evidence, rng)
        return [_beside_robot(figures, evidence), beside]
    landmarks = _candidates(reading.landmark, evidence)
    pairs = np.array(np.meshgrid(figures, landmarks), np.int32).reshape(2, -1)
    draws = [_seen(pairs[0], pairs[1]), _all_new(reading, share, evidence, rng)]
    if len(landmarks):
        draws.append(_near_seen_landmark(reading, landmarks, share, evidence, rng))
    if len(figures):
        draws.append(_near_seen_figure(reading, figures, share, evidence, rng))
    return draws


def _candidates(class_index: int, evidence: Evidence) -> Ints:
    return evidence.objects.number[evidence.objects.class_log[:, class_index] > _possible]


def _no_one(like: Ints) -> Ints:
    return np.full(len(like), nothing, np.int32)


def _seen(figures: Ints, landmarks: Ints) -> _Draw:
    zeros = np.zeros((len(figures), 2))
    return _Draw(figures, zeros, landmarks, zeros, np.zeros(len(figures)))


def _beside_robot(figures: Ints, evidence: Evidence) -> _Draw:
    places = np.tile([evidence.viewer.x, evidence.viewer.y], (len(figures), 1))
    zeros = np.zeros((len(figures), 2))
    return _Draw(figures, zeros, _no_one(figures), places, np.zeros(len(figures)))


def _unseen_places(
    share: int, class_index: int, evidence: Evidence, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Places (n, 2) from prior times miss grid, and log density (n,) times count."""
    tries = prior.sample_places(rng, evidence.viewer, _oversampling * share)
    miss = missed(tries, class_index, evidence)
    edges = np.cumsum(np.exp(miss))
    picks = (np.arange(share) + rng.random()) / share * edges[-1]
    rows = np.minimum(np.searchsorted(edges, picks), len(tries) - 1)
    log_mean = np.log(edges[-1] / len(tries))
    density = prior.log_place(tries[rows], evidence.viewer) + miss[rows] - log_mean
    return tries[rows], density + np.log(share)


def _new_alone(reading: Reading, share: int, evidence: Evidence, rng: np.random.Generator) -> _Draw:
    places, log_proposal = _unseen_places(share, reading.figure, evidence, rng)
    new = np.full(share, hypothesised_figure, np.int32)
    return _Draw(new, places, _no_one(new), np.zeros((share, 2)), log_proposal)


def _all_new(reading: Reading, share: int, evidence: Evidence, rng: np.random.Generator) -> _Draw:
    assert reading.landmark is not None
    places, log_proposal = _unseen_places(share, reading.landmark, evidence.for_landmarks, rng)
    new = np.full(share, hypothesised_landmark, np.int32)
    return _new_figure(reading, new, places, log_proposal, evidence, rng)


def _near_seen_landmark(
    reading: Reading, landmarks: Ints, share: int, evidence: Evidence, rng: np.random.Generator
) -> _Draw:
    each = max(_least, share // len(landmarks))
    numbers = np.repeat(landmarks, each)
    places = _where(numbers, evidence)
    counts = np.full(len(numbers), np.log(each))
    return _new_figure(reading, numbers, places, counts, evidence, rng)


def _new_figure(
    reading: Reading,
    landmark: Ints,
    places: Floats,
    log_proposal: Floats,
    evidence: Evidence,
    rng: np.random.Generator,
) -> _Draw:
    """Figures drawn from the relation around landmarks (n, 2), which have their own density."""
    assert reading.relation is not None
    new = np.full(len(places), hypothesised_figure, np.int32)
    frame = relation_frame(reading, places, evidence.viewer)
    phi = relation_features(reading, frame, new, landmark, evidence)
    offset = reading.relation.sample(rng.random((len(places), 3)), frame, phi)
    density = reading.relation.log_density(frame, offset, phi, 0.0)
    return _Draw(new, places + offset, landmark, places, log_proposal + density)


def _near_seen_figure(
    reading: Reading, figures: Ints, share: int, evidence: Evidence, rng: np.random.Generator
) -> _Draw:
    """Landmarks drawn from the relation turned round, in the frame at the figure."""
    assert reading.relation is not None
    each = max(_least, share // len(figures))
    numbers = np.repeat(figures, each)
    places = _where(numbers, evidence)
    new = np.full(len(numbers), hypothesised_landmark, np.int32)
    frame = relations.frame_at(places, evidence.viewer)
    phi = relation_features(reading, frame, numbers, new, evidence)
    # The frame belongs at the landmark, which is not known yet: blur makes up for the difference.
    blur = _turned_round * rng.standard_normal(places.shape)
    offset = reading.relation.sample(rng.random((len(places), 3)), frame, phi) + blur
    density = reading.relation.log_density(frame, offset, phi, _turned_round**2)
    return _Draw(numbers, places, new, places - offset, density + np.log(each))


def _where(numbers: Ints, evidence: Evidence) -> Floats:
    rows = np.argmax(numbers[:, None] == evidence.objects.number[None], axis=1)
    return evidence.objects.mean[rows]
