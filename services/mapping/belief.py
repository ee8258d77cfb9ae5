"""The filter's state as the message that it publishes, and back."""

from dataclasses import dataclass, fields

import numpy as np

from schemas.arrays import Floats, Ints
from schemas.belief import MapBelief
from schemas.geometry import Pose2
from services.mapping import prior, relations
from services.mapping.backbone import Backbone, Uncertainty
from services.mapping.filter import SemanticFilter
from services.mapping.objects import TrackedObject
from services.mapping.particles import (
    Particles,
    hypothesised_figure,
    hypothesised_landmark,
    nothing,
)
from services.mapping.target import missed

_prior_existence = 0.9
_typical_height = 0.8
_restored_hits = 10


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
    """Seen objects once, then each particle's hypothesised figure and landmark."""
    particles = semantic.particles
    rows = _stacked([_seen(semantic), _figures(semantic), _landmarks(semantic)])
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
        topology=np.zeros(len(particles), np.int32),
        node_regions=np.zeros((0, len(semantic.backbone.trajectory)), np.int32),
        region_edges=np.zeros((0, 3), np.int32),
        viewer=semantic.viewer,
        map_from_odom=semantic.backbone.map_from_odom,
        map_from_base=semantic.backbone.locate(odom_from_base),
        trajectory=semantic.backbone.trajectory,
        effective_particles=particles.effective,
    )


def restore(semantic: SemanticFilter, belief: MapBelief) -> None:
    """Put a fresh filter where `belief` left it.

    What an utterance means is not part of a belief: the next `recall` brings it back.
    """
    odom_from_base = belief.map_from_odom.inverse() @ belief.map_from_base
    backbone = Backbone(belief.map_from_base, odom_from_base, np.array(belief.trajectory))
    for row in np.flatnonzero(belief.particle == nothing):
        thing = _thing(belief, int(row))
        semantic.objects.restore(thing)
        backbone.restore(thing.number, thing.mean, thing.covariance)
    semantic.backbone = backbone
    semantic.viewer = belief.viewer
    semantic.particles = _particles(belief)


def _stacked(blocks: list[_Rows]) -> _Rows:
    names = [field.name for field in fields(_Rows)]
    return _Rows(**{n: np.concatenate([getattr(block, n) for block in blocks]) for n in names})


def _seen(semantic: SemanticFilter) -> _Rows:
    objects = semantic.objects.columns
    classes = np.argmax(objects.class_log, axis=1).astype(np.int32)
    extents = [thing.extent for thing in semantic.objects.confirmed]
    return _Rows(
        particle=np.full(len(classes), nothing, np.int32),
        node=objects.number,
        class_index=classes,
        class_probability=np.exp(objects.class_log.max(axis=1, initial=-np.inf)),
        position=objects.mean,
        covariance=objects.covariance,
        extent=np.array(extents).reshape(-1, 3),
        existence=objects.existence,
    )


def _figures(semantic: SemanticFilter) -> _Rows:
    particles = semantic.particles
    rows = np.flatnonzero(particles.figure == hypothesised_figure).astype(np.int32)
    wanted = [reading.figure for reading in semantic.readings]
    return _hypothesised(
        semantic, rows, hypothesised_figure, particles.figure_position[rows], wanted
    )


def _landmarks(semantic: SemanticFilter) -> _Rows:
    particles = semantic.particles
    rows = np.flatnonzero(particles.landmark == hypothesised_landmark).astype(np.int32)
    wanted = [reading.landmark or 0 for reading in semantic.readings]
    return _hypothesised(
        semantic, rows, hypothesised_landmark, particles.landmark_position[rows], wanted
    )


def _hypothesised(
    semantic: SemanticFilter, rows: Ints, node: int, places: Floats, wanted: list[int]
) -> _Rows:
    classes = np.array(wanted, np.int32)[semantic.particles.reading[rows]] if wanted else rows[:0]
    radii = [prior.typical_radius(semantic.classes[index]) for index in classes.tolist()]
    side = 2 * np.array(radii)
    unseen = _prior_existence * np.exp(missed(places, semantic.evidence))
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


def _thing(belief: MapBelief, row: int) -> TrackedObject:
    classes = len(belief.classes)
    likely = min(max(float(belief.class_probability[row]), 1e-3), 1 - 1e-3)
    share = np.full(classes, (1 - likely) / max(classes - 1, 1))
    share[belief.class_index[row]] = likely
    existence = min(max(float(belief.existence[row]), 1e-3), 1 - 1e-3)
    return TrackedObject(
        number=int(belief.node[row]),
        mean=np.array(belief.position[row]),
        covariance=np.array(belief.covariance[row]),
        extent=np.array(belief.extent[row]),
        class_log=np.log(share),
        odds=float(np.log(existence / (1 - existence))),
        hits=_restored_hits,
        seen_with=Uncertainty(0.0, 0.0),
    )


def _particles(belief: MapBelief) -> Particles:
    return Particles(
        log_weight=np.log(np.maximum(belief.weights, 1e-300)),
        reading=np.zeros(len(belief.weights), np.int32),
        figure=np.array(belief.figure),
        landmark=np.array(belief.landmark),
        figure_position=_places(belief, hypothesised_figure),
        landmark_position=_places(belief, hypothesised_landmark),
    )


def _places(belief: MapBelief, node: int) -> Floats:
    viewer = np.array([belief.viewer.x, belief.viewer.y])
    places = np.tile(viewer, (len(belief.weights), 1))
    rows = (belief.node == node) & (belief.particle != nothing)
    places[belief.particle[rows]] = belief.position[rows]
    return places
