"""How well a hypothesis fits all evidence: the density that the particles sample.

For a reading with figure class h, relation and landmark class c, in logs:

    p0(l) + p_rel(f | l)
    + [l seen: P(class = c) existence / rho,  l hypothesised: missed(l)]
    + [f seen: P(class = h) existence / rho,  f hypothesised: missed(f)]
    + [comparative, and a competitor is nearer: 0.01]
    + what else was said about f or l (`clues`)

rho, the density of unrelated objects, is the concentration of the Dirichlet process of Section
"Modifying the graph based on natural language"; `missed` is Eq. likelihood_appearance for the
regions that nobody observed, landmarks as well as figures.
"""

from dataclasses import dataclass, replace

import numpy as np

from schemas.arrays import Flags, Floats, Ints
from schemas.geometry import Pose2
from services.mapping import clues, prior, relations, rivals
from services.mapping.annotations import Reading, robot_class
from services.mapping.clues import Clue
from services.mapping.grid import Grid
from services.mapping.insides import Insides
from services.mapping.layout import Layout
from services.mapping.objects import ObjectColumns
from services.mapping.particles import Particles, hypothesised_figure
from services.mapping.prior import Meant, Role
from services.mapping.relations import Relation

_impossible = -30.0
_overlooked = float(np.log(0.01))
_same_place = 0.5
"""A thing nobody saw is not where another thing was seen [m]."""
_sigma_points = relations.residual * np.array([[0, 0], [1, 1], [1, -1], [-1, 1], [-1, -1]])


@dataclass(frozen=True)
class Evidence:
    """What all hypotheses are judged by."""

    classes: tuple[str, ...]
    objects: ObjectColumns
    """What was seen: objects, and the places of one topology."""
    grid: Grid
    viewer: Pose2
    """map_from_base when the utterance was heard."""
    readings: tuple[Reading, ...]
    locations: int = 0
    """How many classes, the last ones, are types of places."""
    layout: Layout | None = None
    """Which ground belongs to places that were seen; None where language has no places."""
    insides: Insides | None = None
    """What was looked into; None where nothing was."""

    def is_place(self, class_index: int | None) -> bool:
        """Whether a class is a type of place."""
        return class_index is not None and class_index >= len(self.classes) - self.locations

    def meant_as(self, role: Role, class_index: int | None) -> Meant:
        """By which prior things of a class are placed that are spoken of in a role."""
        return prior.as_room[role] if self.is_place(class_index) else role

    @property
    def for_landmarks(self) -> "Evidence":
        """By which landmarks that nobody saw are judged: all of it."""
        return self


def log_target(particles: Particles, evidence: Evidence) -> Floats:
    """Unnormalised log density (P,) of each hypothesis."""
    values = np.full(len(particles), _impossible)
    for number, reading in enumerate(evidence.readings):
        rows = np.flatnonzero(particles.reading == number).astype(np.int32)
        values[rows] = _of_reading(particles.take(rows), reading, evidence)
    return values


def placed(particles: Particles, objects: ObjectColumns) -> Particles:
    """The same hypotheses with seen figures and landmarks where they are now."""
    return replace(
        particles,
        figure_position=_positions(particles.figure, particles.figure_position, objects),
        landmark_position=_positions(particles.landmark, particles.landmark_position, objects),
    )


def missed(points: Floats, class_index: int | None, evidence: Evidence) -> Floats:
    """Log probability (n,) that a thing around each point (n, 2) was not seen all the while.

    A place is seen by what kind of place the ground belongs to, an object by looking at the ground.
    """
    around = _log_unseen(points[:, None] + _sigma_points, class_index, evidence)
    free = np.log(np.mean(np.exp(around), axis=1))
    if evidence.layout is not None and evidence.is_place(class_index):
        return free
    solid = evidence.objects.number < hypothesised_figure
    if not solid.any():
        return free
    gaps = np.linalg.norm(points[:, None] - evidence.objects.mean[solid], axis=2)
    taken = np.any(gaps < evidence.objects.radius[solid] + _same_place, axis=1)
    return np.where(taken, free + _overlooked, free)


def left_for(points: Floats, class_index: int | None, evidence: Evidence) -> Floats:
    """Mean place (n, 2) of a thing around each point (n, 2), given that it was not seen.

    The relation says where a thing is up to its residual; what was looked at of that is less likely
    to hold it, and the rest lies further from where the robot has been.
    """
    around = points[:, None] + _sigma_points
    log_share = _log_unseen(around, class_index, evidence)
    share = np.exp(log_share - log_share.max(axis=1, keepdims=True))
    return np.einsum("ns,nsd->nd", share, around) / share.sum(axis=1, keepdims=True)


def _log_unseen(points: Floats, class_index: int | None, evidence: Evidence) -> Floats:
    """Log probability (...) that a thing at each point (..., 2) would not have been seen."""
    if evidence.layout is not None and evidence.is_place(class_index):
        return evidence.layout.log_unseen(points)
    return evidence.grid.looked_at(points)


def relation_frame(reading: Reading, landmark: Floats, viewer: Pose2) -> relations.Frame:
    """Frame of the relation at landmarks (n, 2), or at the robot when it is the landmark."""
    if reading.landmark is None:
        return relations.frame_of_robot(viewer, len(landmark))
    return relations.frame_at(landmark, viewer)


def relation_features(
    reading: Reading, frame: relations.Frame, figure: Ints, landmark: Ints, evidence: Evidence
) -> Floats:
    """Columns phi (n, D) of things by id: sizes are typical for what was not seen."""
    objects = evidence.objects
    radius = _size_of(figure, reading.figure, objects.radius, evidence)
    half = _size_of(landmark, reading.landmark, objects.half_extent, evidence)
    return relations.features_of(frame, radius, half)


def _of_reading(particles: Particles, reading: Reading, evidence: Evidence) -> Floats:
    value = reading.log_probability + _of_figure(particles, reading, evidence)
    value += np.where(np.isin(particles.figure, reading.not_meant), _impossible, 0.0)
    if reading.relation is None:
        role = evidence.meant_as("figure", reading.figure)
        return value + prior.log_place(role, particles.figure_position, evidence.viewer)
    value += _relation_term(particles, reading, reading.relation, evidence)
    for clue in reading.clues:
        value += _clue_term(particles, clue, reading, evidence)
    if reading.landmark is None:
        return value
    role = evidence.meant_as("landmark", reading.landmark)
    value += prior.log_place(role, particles.landmark_position, evidence.viewer)
    value += _standing(
        particles.landmark, particles.landmark_position, reading.landmark, evidence.for_landmarks
    )
    value += np.where(particles.figure == particles.landmark, _impossible, 0.0)
    return value + (_competition(particles, reading, evidence) if reading.comparative else 0.0)


def _of_figure(particles: Particles, reading: Reading, evidence: Evidence) -> Floats:
    """How well the figures (P,) go with what was seen, and with where nothing was seen."""
    standing = _standing(particles.figure, particles.figure_position, reading.figure, evidence)
    if not reading.enclosed:
        return standing
    hidden = np.zeros(len(particles))
    if evidence.insides is not None:
        hidden = evidence.insides.log_missed(particles.landmark, reading.figure)
    seen, _ = _rows(particles.figure, evidence.objects)
    return np.where(seen, standing, hidden)


def _standing(numbers: Ints, points: Floats, class_index: int, evidence: Evidence) -> Floats:
    unseen = missed(points, class_index, evidence)
    objects = evidence.objects
    if not len(objects.number):
        return unseen
    seen, row = _rows(numbers, objects)
    known = objects.class_log[row, class_index] + np.log(objects.existence[row])
    density = prior.density_of(evidence.classes[class_index])
    return np.where(seen, known - np.log(density), unseen)


def _relation_term(
    particles: Particles, reading: Reading, relation: Relation, evidence: Evidence
) -> Floats:
    figure_seen, _ = _rows(particles.figure, evidence.objects)
    variance = np.where(figure_seen, relations.residual**2, 0.0)
    for numbers in (particles.figure, particles.landmark):
        variance = variance + _variance(numbers, evidence.objects)
    frame = relation_frame(reading, particles.landmark_position, evidence.viewer)
    offset = particles.figure_position - particles.landmark_position
    phi = relation_features(reading, frame, particles.figure, particles.landmark, evidence)
    return relation.log_density(frame, offset, phi, variance)


def _size_of(numbers: Ints, class_index: int | None, sizes: Floats, evidence: Evidence) -> Floats:
    """Sizes (n, ...) of things by id, out of those (K, ...) of the seen ones [m]."""
    name = robot_class if class_index is None else evidence.classes[class_index]
    typical = np.full((len(numbers), *sizes.shape[1:]), prior.typical_radius(name))
    seen, row = _rows(numbers, evidence.objects)
    typical[seen] = sizes[row[seen]]
    return typical


def _clue_term(particles: Particles, clue: Clue, reading: Reading, evidence: Evidence) -> Floats:
    if clue.of_figure:
        anchors, role = particles.figure_position, evidence.meant_as("figure", reading.figure)
    else:
        anchors, role = particles.landmark_position, evidence.meant_as("landmark", reading.landmark)
    log_missed = missed(clues.unseen_places(evidence.viewer), clue.other, evidence)
    return clues.log_factor(clue, role, anchors, evidence.objects, log_missed, evidence.viewer)


def _variance(numbers: Ints, objects: ObjectColumns) -> Floats:
    if not len(objects.number):
        return np.zeros(len(numbers))
    seen, row = _rows(numbers, objects)
    return np.where(seen, np.trace(objects.covariance[row], axis1=1, axis2=2) / 2, 0.0)


def _competition(particles: Particles, reading: Reading, evidence: Evidence) -> Floats:
    landmark = particles.landmark_position
    own = np.linalg.norm(landmark - particles.figure_position, axis=1)
    figure_seen, _ = _rows(particles.figure, evidence.objects)
    variance = np.where(
        figure_seen, _variance(particles.figure, evidence.objects), relations.residual**2
    )
    partners = np.stack([particles.figure, particles.landmark], axis=1)
    seen = rivals.log_no_seen_rival(
        landmark, own, variance, partners, reading.figure, evidence.objects
    )
    log_unseen = _log_unseen(rivals.disc_round(landmark, own), reading.figure, evidence)
    density = prior.density_of(evidence.classes[reading.figure])
    return seen + rivals.log_no_unseen_rival(own, log_unseen, density)


def _positions(numbers: Ints, points: Floats, objects: ObjectColumns) -> Floats:
    if not len(objects.number):
        return points
    seen, row = _rows(numbers, objects)
    return np.where(seen[:, None], objects.mean[row], points)


def _rows(numbers: Ints, objects: ObjectColumns) -> tuple[Flags, Ints]:
    if not len(objects.number):
        return np.zeros(len(numbers), np.bool_), np.zeros(len(numbers), np.int32)
    equal = numbers[:, None] == objects.number[None]
    return equal.any(axis=1), np.argmax(equal, axis=1).astype(np.int32)
