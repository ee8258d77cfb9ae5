"""What hypotheses are judged by and drawn from, division of the places by division.

Of a topology only the way in which it divides the pose nodes decides what its regions look like;
those that agree in that are one case, and all their particles are judged in one go.
"""

from dataclasses import dataclass, replace

import numpy as np

from schemas.arrays import Floats, Ints
from services.mapping.allocation import Topologies
from services.mapping.even import EvenPoints
from services.mapping.objects import stacked
from services.mapping.particles import Particles, joined
from services.mapping.places import Places
from services.mapping.proposal import fresh_particles
from services.mapping.target import Evidence, log_target, placed
from services.mapping.topology import Partition

_negligible = -7.0
"""Log share of the posterior below which nothing is drawn for a case."""


@dataclass(frozen=True)
class Case:
    """Topologies that divide the places in one way."""

    topologies: Ints
    """Indices of them."""
    log_weight: float
    """Of all of them by sensors alone, up to a constant."""
    appearance: float
    """The part of it that is the likelihood of the looks at regions."""
    evidence: Evidence
    """With their regions among what was seen."""


def cases_of(topologies: Topologies, places: Places | None, evidence: Evidence) -> list[Case]:
    """All cases; `evidence` is what they have in common."""
    return [
        _case(partition, rows, topologies, places, evidence)
        for partition, rows in topologies.partitions().items()
    ]


def judged(particles: Particles, cases: list[Case]) -> tuple[Particles, Floats]:
    """Hypotheses with what was seen where it is now, and the log density (P,) they sample."""
    figures, landmarks = particles.figure_position.copy(), particles.landmark_position.copy()
    values = np.zeros(len(particles))
    for case in cases:
        rows = np.flatnonzero(np.isin(particles.topology, case.topologies)).astype(np.int32)
        if len(rows):
            now = placed(particles.take(rows), case.evidence.objects)
            figures[rows], landmarks[rows] = now.figure_position, now.landmark_position
            values[rows] = log_target(now, case.evidence) + case.appearance
    return replace(particles, figure_position=figures, landmark_position=landmarks), values


def drawn(
    cases: list[Case],
    count: int,
    topologies: Topologies,
    points: EvenPoints,
    rng: np.random.Generator,
) -> Particles:
    """Weighted hypotheses, more than `count`, that are one sample of the posterior of all cases.

    Args:
        cases: of the topologies.
        count: number of particles.
        topologies: which of them a hypothesis has is drawn too.
        points: what groundings and places are made of.
        rng: for the topologies.
    """
    total = np.logaddexp.reduce([case.log_weight for case in cases])
    pools: list[Particles] = []
    for case in cases:
        share = case.log_weight - total
        if share > _negligible:
            pool = fresh_particles(max(1, round(count * np.exp(share))), case.evidence, points)
            weight = pool.log_weight + pool.log_total + share
            topology = _any_of(case.topologies, len(pool), topologies, rng)
            pools.append(replace(pool, log_weight=weight, topology=topology))
    pool = joined(pools)
    return pool.weighted(pool.log_weight)


def _case(
    partition: Partition,
    rows: Ints,
    topologies: Topologies,
    places: Places | None,
    evidence: Evidence,
) -> Case:
    prior = float(np.logaddexp.reduce(topologies.log_prior[rows]))
    if places is None:
        return Case(rows, prior, 0.0, evidence)
    sight = places.seen(partition)
    seen = stacked([evidence.objects, sight.regions, places.glimpses])
    appearance = sight.log_likelihood
    return Case(rows, prior + appearance, appearance, replace(evidence, objects=seen))


def _any_of(rows: Ints, count: int, topologies: Topologies, rng: np.random.Generator) -> Ints:
    """Topologies (count,) among some, by their share."""
    if len(rows) == 1:
        return np.full(count, rows[0], np.int32)
    log_prior = topologies.log_prior[rows]
    share = np.exp(log_prior - np.logaddexp.reduce(log_prior))
    return rng.choice(rows, count, p=share / share.sum())
