"""Situations of training worlds in which it is known what an utterance means.

The robot has gone some of the way towards one of the things and has seen what came within its
view. What it believes then is scored by what is true: which of the things that it saw are meant,
or that the thing that is meant is none of them. The posterior is taken apart by what its
hypotheses take for known, so that other densities of unrelated things only reweight the parts:
each thing that was seen stands for a factor of one over the density of its class.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.optimize import minimize

from schemas.arrays import Flags, Floats, Ints
from schemas.geometry import Pose2
from services.mapping.annotations import Reading
from services.mapping.even import EvenPoints
from services.mapping.grid import Grid
from services.mapping.objects import ObjectColumns
from services.mapping.particles import hypothesised_figure, hypothesised_landmark, nothing
from services.mapping.proposal import fresh_particles
from services.mapping.relation_table import relation_named
from services.mapping.target import Evidence
from services.mapping.training.worlds import TrainingWorld
from services.mapping.visibility import log_floor

CLASSES = ("hydrant", "cone")
_unnamed = ("figure", "landmark")
"""Classes of which nothing is known, so that what was learned before has no say."""
_ranges = (3.0, 5.0)
"""How far the robot sees [m]."""
_step = 0.5
_log_changes = (-2.5, 2.5)
_particles = 100
_sure = (0.97, 0.95)
"""Probability of a seen thing's class, and of its existence."""
_alone = Reading(0.0, 0, None, None, comparative=False)
_behind = Reading(0.0, 0, relation_named("back", comparative=False), 1, comparative=False)
_nearest = Reading(0.0, 0, relation_named("near", comparative=True), 1, comparative=True)


@dataclass(frozen=True)
class Scored:
    """What was believed in n situations, by parts of the posterior."""

    mass: Floats
    """(n, 2, 2, 3): figure seen or not; landmark seen or not; 1 if it is the truth, 2 if it is the
    likeliest of the seen figures that are not, else 0."""
    alone: Flags
    """(n,) whether the utterance names no landmark."""

    def probability(self, log_change: Floats) -> Floats:
        """(n,) of the truth when the log densities of both classes are changed by (2,)."""
        return self._parts(log_change)[..., 1].sum(axis=(1, 2))

    def best_found(self, log_change: Floats) -> tuple[Floats, Flags]:
        """Of the likeliest figure that is found, with its landmark: probability, and if it is true.

        Both (n,); the probability is 0 where nothing was found.
        """
        parts = self._parts(log_change)
        found = np.where(self.alone[:, None], parts[:, 1, 0], parts[:, 1, 1])
        return found[:, 1:].max(axis=1), found[:, 1] > found[:, 2]

    def _parts(self, log_change: Floats) -> Floats:
        figure, landmark = np.exp(-np.outer([0, 1], log_change)).T
        parts = self.mass * figure[:, None, None] * landmark[:, None]
        return parts / parts.sum(axis=(1, 2, 3), keepdims=True)


@dataclass(frozen=True)
class Situation:
    """What is known, and what is true."""

    evidence: Evidence
    figure: int
    """Id of what is meant, `hypothesised_figure` where it was not seen."""
    landmark: int
    """Likewise."""


def fit_densities(scored: Scored) -> Floats:
    """Change (2,) of the log densities under which the truth is most probable."""

    def loss(log_change: Floats) -> float:
        return -float(np.mean(np.log(np.maximum(scored.probability(log_change), 1e-6))))

    change = minimize(loss, np.zeros(2), bounds=[_log_changes] * 2, method="L-BFGS-B").x
    return np.asarray(change)


def score(worlds: Sequence[TrainingWorld], rng: Generator) -> Scored:
    """One situation of each world and each utterance that fits it."""
    points = EvenPoints(rng)
    cases = [(world, reading) for world in worlds for reading in _readings(world)]
    masses = [_masses(_situation(world, reading, rng), points) for world, reading in cases]
    return Scored(np.array(masses), np.array([reading.landmark is None for _, reading in cases]))


def _readings(world: TrainingWorld) -> tuple[Reading, ...]:
    return (_nearest,) if world.name == "nearest_hydrant" else (_alone, _behind)


def _situation(world: TrainingWorld, reading: Reading, rng: Generator) -> Situation:
    """What is known after some of the way; things have their number in the world as id."""
    things = np.concatenate([world.hydrants, world.cones])
    kinds = np.repeat([0, 1], [len(world.hydrants), len(world.cones)]).astype(np.int32)
    towards = things[rng.integers(len(things))]
    way = rng.uniform(0.3, 1.1) * np.linalg.norm(towards)
    share = np.arange(0.0, way, _step)[:, None] / np.linalg.norm(towards)
    path = share * towards
    reach = float(rng.choice(_ranges))
    seen = np.linalg.norm(things[:, None] - path, axis=2).min(axis=1) < reach
    objects = _objects(np.flatnonzero(seen).astype(np.int32), things[seen], kinds[seen])
    cone = len(world.hydrants)
    return Situation(
        Evidence(_unnamed, objects, _looked(path, reach), Pose2(0.0, 0.0, 0.0), (reading,)),
        figure=0 if seen[0] else hypothesised_figure,
        landmark=cone if seen[cone] else hypothesised_landmark,
    )


def _objects(numbers: Ints, places: Floats, kinds: Ints) -> ObjectColumns:
    count = len(numbers)
    certain, exists = _sure
    likely = np.where(kinds[:, None] == np.arange(2), certain, 1 - certain)
    return ObjectColumns(
        number=numbers,
        mean=places.reshape(-1, 2),
        covariance=np.tile(0.01 * np.eye(2), (count, 1, 1)),
        radius=np.full(count, 0.2),
        half_extent=np.full((count, 2), 0.2),
        class_log=np.log(likely).reshape(-1, 2),
        existence=np.full(count, exists),
    )


def _looked(path: Floats, reach: float) -> Grid:
    grid = Grid((0.0, 0.0))
    rows, columns = grid.looked.shape
    y = grid.origin[1] + grid.resolution * (np.arange(rows)[:, None] + 0.5)
    x = grid.origin[0] + grid.resolution * (np.arange(columns) + 0.5)
    for stop in path:
        grid.looked[np.hypot(x - stop[0], y - stop[1]) < reach] = log_floor
    return grid


def _masses(situation: Situation, points: EvenPoints) -> Floats:
    """Parts of the posterior (2, 2, 3), see `Scored`."""
    pool = fresh_particles(_particles, situation.evidence, points)
    alone = pool.landmark == nothing
    true = (pool.figure == situation.figure) & (alone | (pool.landmark == situation.landmark))
    figure_seen = pool.figure < hypothesised_figure
    landmark_seen = ~alone & (pool.landmark < hypothesised_figure)
    wrong = [(pool.figure == one) & ~true & figure_seen for one in np.unique(pool.figure)]
    likeliest = max(wrong, key=lambda rows: float(pool.weights[rows].sum()))
    columns = (figure_seen, landmark_seen, np.where(true, 1, 2 * likeliest))
    masses = np.zeros((2, 2, 3))
    np.add.at(masses, tuple(column.astype(np.int32) for column in columns), pool.weights)
    return masses
