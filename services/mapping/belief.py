"""The filter's state as the message that it publishes."""

from dataclasses import dataclass, fields, replace

import numpy as np

from schemas.arrays import Flags, Floats, Ints
from schemas.belief import MapBelief, first_topology, shared
from schemas.geometry import Pose2
from services.mapping import prior, relations
from services.mapping.filter import SemanticFilter
from services.mapping.objects import ObjectColumns
from services.mapping.particles import (
    Particles,
    first_region,
    hypothesised_figure,
    hypothesised_landmark,
)
from services.mapping.target import left_for, missed
from services.mapping.topology import Topology, assignment

_prior_existence = 0.9
_typical_height, _room_height = 0.8, 2.5


@dataclass(frozen=True)
class _Rows:
    """The columns of `MapBelief` that have a row for each object."""

    particle: Ints
    node: Ints
    class_index: Ints
    class_probability: Floats
    position: Floats
    covariance: Floats
    extent: Floats
    existence: Floats


def belief_of(
    semantic: SemanticFilter, stamp_ns: int, instruction_id: str, odom_from_base: Pose2
) -> MapBelief:
    """What was seen once, then each particle's hypothesised figure and landmark."""
    particles = semantic.particles
    topologies, topology = _distinct(semantic)
    rows = _stacked([*_seen(semantic, topologies), _figures(semantic), _landmarks(semantic)])
    return MapBelief(
        stamp_ns=stamp_ns,
        instruction_id=instruction_id,
        classes=semantic.classes,
        weights=particles.weights,
        particle=rows.particle,
        node=rows.node,
        class_index=rows.class_index,
        class_probability=rows.class_probability,
        position=rows.position,
        covariance=rows.covariance,
        extent=rows.extent,
        existence=rows.existence,
        figure=particles.figure,
        landmark=particles.landmark,
        figure_class=_said(particles.figure, [one.figure for one in semantic.readings], particles),
        landmark_class=_said(
            particles.landmark, [one.landmark for one in semantic.readings], particles
        ),
        topology=topology,
        node_regions=_node_regions(topologies, len(semantic.backbone.trajectory)),
        region_edges=_region_edges(topologies),
        viewer=semantic.viewer,
        map_from_odom=semantic.backbone.map_from_odom,
        map_from_base=semantic.backbone.locate(odom_from_base),
        trajectory=semantic.backbone.trajectory,
        effective_particles=particles.effective,
    )


def _said(numbers: Ints, classes: list[int | None], particles: Particles) -> Ints:
    """Class (P,) that the reading of each particle names for its object, -1 for none."""
    named = np.array([-1 if one is None else one for one in (*classes, None)], np.int32)
    return np.where(numbers < 0, np.int32(-1), named[particles.reading])


def _stacked(blocks: list[_Rows]) -> _Rows:
    names = [field.name for field in fields(_Rows)]
    return _Rows(**{n: np.concatenate([getattr(block, n) for block in blocks]) for n in names})


def _distinct(semantic: SemanticFilter) -> tuple[list[Topology], Ints]:
    """Topologies that look different, none for robots without places, and each particle's (P,).

    Those that differ in what they declined alone are one to everybody else.
    """
    found: dict[tuple[object, ...], Topology] = {}
    numbers: list[int] = []
    for topology in semantic.topologies.members:
        key = (topology.partition, topology.edges)
        found.setdefault(key, topology)
        numbers.append(list(found).index(key))
    renamed = np.array(numbers, np.int32)[semantic.particles.topology]
    return [] if semantic.places is None else list(found.values()), renamed


def _seen(semantic: SemanticFilter, topologies: list[Topology]) -> list[_Rows]:
    """Objects, places that were looked into, and the regions of each topology."""
    heights = [float(thing.extent[2]) for thing in semantic.objects.confirmed]
    found = [_rows(semantic.objects.columns, shared, np.array(heights))]
    if (places := semantic.places) is None:
        return found
    blocks = [(shared, places.glimpses)]
    for index, topology in enumerate(topologies):
        blocks.append((first_topology - index, places.seen(topology.partition).regions))
    for owner, things in blocks:
        found.append(_rows(things, owner, np.full(len(things.number), _room_height)))
    return found


def _rows(things: ObjectColumns, owner: int, height: Floats) -> _Rows:
    classes = np.argmax(things.class_log, axis=1).astype(np.int32)
    return _Rows(
        particle=np.full(len(classes), owner, np.int32),
        node=things.number,
        class_index=classes,
        class_probability=np.exp(things.class_log.max(axis=1, initial=-np.inf)),
        position=things.mean,
        covariance=things.covariance,
        extent=np.column_stack([2 * things.half_extent, height]),
        existence=things.existence,
    )


def _node_regions(topologies: list[Topology], count: int) -> Ints:
    partitions = [topology.partition for topology in topologies]
    names = [
        np.array([nodes[0] for nodes in partition])[assignment(partition, count)]
        for partition in partitions
    ]
    return first_region + np.array(names, np.int32).reshape(-1, count)


def _region_edges(topologies: list[Topology]) -> Ints:
    edges = [
        (index, first_region + one, first_region + other)
        for index, topology in enumerate(topologies)
        for one, other in sorted(topology.edges)
    ]
    return np.array(edges, np.int32).reshape(-1, 3)


def _figures(semantic: SemanticFilter) -> _Rows:
    particles = semantic.particles
    rows = np.flatnonzero(particles.figure == hypothesised_figure).astype(np.int32)
    wanted = [reading.figure for reading in semantic.readings]
    enclosed = np.array([reading.enclosed for reading in semantic.readings], np.bool_)
    inside = enclosed[particles.reading[rows]] if len(enclosed) else np.zeros(len(rows), np.bool_)
    places = particles.figure_position[rows]
    figures = _hypothesised(semantic, rows, hypothesised_figure, places, wanted, inside)
    return replace(figures, position=_left_for(semantic, rows, places))


def _left_for(semantic: SemanticFilter, rows: Ints, places: Floats) -> Floats:
    """Where figures (n, 2) that a relation places can still be, see `target.left_for`.

    What was drawn from the prior has no residual, and what lies in something stays in it.
    """
    left = places.copy()
    for number, reading in enumerate(semantic.readings):
        own = semantic.particles.reading[rows] == number
        if reading.relation is not None and not reading.enclosed and own.any():
            left[own] = left_for(places[own], reading.figure, semantic.evidence)
    return left


def _landmarks(semantic: SemanticFilter) -> _Rows:
    particles = semantic.particles
    rows = np.flatnonzero(particles.landmark == hypothesised_landmark).astype(np.int32)
    wanted = [reading.landmark or 0 for reading in semantic.readings]
    standing_free = np.zeros(len(rows), np.bool_)
    return _hypothesised(
        semantic,
        rows,
        hypothesised_landmark,
        particles.landmark_position[rows],
        wanted,
        standing_free,
    )


def _hypothesised(
    semantic: SemanticFilter,
    rows: Ints,
    node: int,
    places: Floats,
    wanted: list[int],
    enclosed: Flags,
) -> _Rows:
    classes = np.array(wanted, np.int32)[semantic.particles.reading[rows]] if wanted else rows[:0]
    radii = [prior.typical_radius(semantic.classes[index]) for index in classes.tolist()]
    side = 2 * np.array(radii)
    evidence = semantic.evidence
    log_missed = np.zeros(len(rows))
    for index in np.unique(classes).tolist():
        # Whoever looked at the ground about a box has not seen what is in it.
        own = (classes == index) & ~enclosed
        log_missed[own] = missed(places[own], index, evidence)
    unseen = _prior_existence * np.exp(log_missed)
    return _Rows(
        particle=rows,
        node=np.full(len(rows), node, np.int32),
        class_index=classes,
        class_probability=np.ones(len(rows)),
        position=places,
        covariance=np.tile(relations.residual**2 * np.eye(2), (len(rows), 1, 1)),
        extent=np.stack([side, side, np.full(len(rows), _typical_height)], axis=1),
        existence=unseen / (unseen + 1 - _prior_existence),
    )
