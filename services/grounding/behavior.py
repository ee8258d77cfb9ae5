"""Behaviour inference: which objects of a map hypothesis an intent is about (paper, sec:nlu).

For one intent in classes, a behaviour of Γ^{A_O} is a (figure, landmark) pair of objects of those
classes.  One instruction means at most one pair, and the Bernoulli variables of the factor graph,
conditioned on at most one being true, are a softmax over the pairs and "none" with logit zero.  The
mass of "none" is kept: it is the reason to explore.  All particles are done at once, as ragged
columns; no value depends on another particle's objects.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from services.grounding.spatial import Placement, is_unbounded, truth, viewer_frame
from services.grounding.symbols import ROBOT
from services.grounding.understanding import UNKNOWN, Intent
from services.grounding.world import WorldObjects

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

NONE = -1
"""Index where there is no object: the robot itself, no landmark, or one the map lacks."""

TRUTH_EDGES = np.array([0.1, 0.3, 0.5, 0.7, 0.9, 0.97])
PAIR_FEATURES = (
    "pair",
    *(f"truth {bin_}" for bin_ in range(len(TRUTH_EDGES) + 1)),
    "unbounded false",
    "unbounded true",
    "nearest",
    "second nearest",
    "farther",
    "no relation",
    "robot placed",
    "landmark missing",
    "only one of its class",
    "hypothesised",
)
_COLUMN = {name: at for at, name in enumerate(PAIR_FEATURES)}
_ROBOT_HALF = 0.5
"""Half edge of the robot's own bounding box [m]."""
_ELONGATED = 1.5
"""A box whose edges have at least this ratio has a long axis."""


@dataclass(frozen=True)
class Objects:
    """The objects of P hypotheses joined: M rows, grouped by hypothesis."""

    classes: Ints
    positions: Floats
    half_extents: Floats
    """Horizontal half edges of the boxes, along world x and y [m] (M, 2)."""
    observed: NDArray[np.bool_]
    world: Ints
    """Hypothesis of each row (M,)."""
    starts: Ints
    """First row of each hypothesis (P,)."""
    viewers: Floats
    """x, y, heading by hypothesis (P, 3)."""

    @classmethod
    def join(cls, worlds: Sequence[WorldObjects]) -> "Objects":
        """Puts the columns of all hypotheses below one another."""
        counts = np.array([len(world.classes) for world in worlds], dtype=np.int64)
        return cls(
            classes=np.concatenate([world.classes for world in worlds]),
            positions=np.concatenate([world.positions for world in worlds])[:, :2],
            half_extents=0.5 * np.concatenate([world.extents[:, :2] for world in worlds]),
            observed=np.concatenate([world.observed for world in worlds]),
            world=np.repeat(np.arange(len(worlds)), counts),
            starts=np.cumsum(counts) - counts,
            viewers=np.array([world.viewer for world in worlds]),
        )


@dataclass(frozen=True)
class Pairs:
    """Candidate (figure, landmark) pairs of all hypotheses, grouped by hypothesis."""

    world: Ints
    figure: Ints
    """Row of `Objects`, or NONE for the robot itself."""
    landmark: Ints
    """Row of `Objects`, or NONE."""


def candidates(intent: Intent, objects: Objects, names: Sequence[str]) -> Pairs:
    """All pairs of the intent's classes; the landmark is NONE where a map lacks it."""
    worlds = len(objects.viewers)
    if intent.object == ROBOT:
        figures, figure_world = np.full(worlds, NONE), np.arange(worlds)
    else:
        figures = np.flatnonzero(objects.classes == _index(intent.object, names))
        figure_world = objects.world[figures]
    landmarks = np.flatnonzero(objects.classes == _index(intent.landmark, names))
    counts = np.bincount(objects.world[landmarks], minlength=worlds)
    firsts = np.cumsum(counts) - counts
    repeats = np.maximum(counts, 1)[figure_world]
    within = np.arange(repeats.sum()) - np.repeat(np.cumsum(repeats) - repeats, repeats)
    world, figure = np.repeat(figure_world, repeats), np.repeat(figures, repeats)
    landmark = np.full(len(world), NONE)
    has = counts[world] > 0
    landmark[has] = landmarks[firsts[world[has]] + within[has]]
    distinct = (figure != landmark) | (figure == NONE)
    return Pairs(world[distinct], figure[distinct], landmark[distinct])


def _index(name: str, names: Sequence[str]) -> int:
    return names.index(name) if name not in (ROBOT, UNKNOWN) else NONE


def place(intent: Intent, pairs: Pairs, objects: Objects) -> Placement:
    """Figures against their landmarks in the viewer's frame; the robot stands at the viewer."""
    viewer = objects.viewers[pairs.world]
    landmark = _rows(pairs.landmark, viewer[:, :2], objects.positions)
    offset = _rows(pairs.figure, viewer[:, :2], objects.positions) - landmark
    of_robot = intent.landmark == ROBOT
    heading = np.stack([np.cos(viewer[:, 2]), np.sin(viewer[:, 2])], axis=1)
    sight = landmark - viewer[:, :2]
    sight = np.where((pairs.landmark == NONE)[:, None], heading, sight)
    along, across = viewer_frame(offset, sight)
    robot = np.full((len(offset), 2), _ROBOT_HALF)
    figure_half = _rows(pairs.figure, robot, objects.half_extents)
    landmark_half = _rows(pairs.landmark, robot, objects.half_extents)
    axis_along, axis_across = viewer_frame(offset, _axis(landmark_half, sight))
    return Placement(
        along=-along if of_robot else along,
        across=across,
        touch=0.5 * (figure_half + landmark_half).sum(axis=1),
        of_robot=of_robot,
        sight=np.hypot(sight[:, 0], sight[:, 1]),
        axis_along=axis_along,
        axis_across=axis_across,
        margin=(landmark_half - np.abs(offset)).min(axis=1),
        area=4.0 * landmark_half[:, 0] * landmark_half[:, 1],
    )


def _rows(rows: Ints, robot: Floats, columns: Floats) -> Floats:
    """Rows of an object column, with the robot's own where there is no object (P, 2)."""
    if not len(columns):
        return robot
    absent = rows == NONE
    return np.where(absent[:, None], robot, columns[rows]) if absent.any() else columns[rows]


def _axis(half: Floats, sight: Floats) -> Floats:
    """Direction of the landmarks' long axes away from the viewer, of sight where they have none."""
    long_x, long_y = half[:, 0] > _ELONGATED * half[:, 1], half[:, 1] > _ELONGATED * half[:, 0]
    x = np.where(long_y, 0.0, np.where(long_x, np.copysign(1.0, sight[:, 0]), sight[:, 0]))
    y = np.where(long_x, 0.0, np.where(long_y, np.copysign(1.0, sight[:, 1]), sight[:, 1]))
    return np.stack([x, y], axis=1)


def features(intent: Intent, pairs: Pairs, objects: Objects) -> NDArray[np.bool_]:
    """Binary features of every pair, columns as in `PAIR_FEATURES`."""
    table = np.zeros((len(pairs.world), len(PAIR_FEATURES)), dtype=np.bool_)
    rows = np.arange(len(table))
    table[:, _COLUMN["pair"]] = True
    missing = (pairs.landmark == NONE) & (intent.landmark not in (ROBOT, UNKNOWN))
    table[missing, _COLUMN["landmark missing"]] = True
    if intent.object == ROBOT:
        table[~missing, _COLUMN["robot placed"]] = True
    elif intent.relation == UNKNOWN:
        table[~missing, _COLUMN["no relation"]] = True
    elif intent.comparative:
        rank = np.minimum(_ranks(pairs, measure(intent.relation, place(intent, pairs, objects))), 2)
        columns = _COLUMN["nearest"] + rank
        table[rows[~missing], columns[~missing]] = True
    else:
        columns = _truth_columns(intent.relation, place(intent, pairs, objects))
        table[rows[~missing], columns[~missing]] = True
    _describe_sought(table, pairs, objects)
    return table


def _truth_columns(relation: str, placement: Placement) -> Ints:
    degrees = truth(relation, placement)
    if is_unbounded(relation):
        # Anything far off is "away", so that a higher degree says nothing more.
        return _COLUMN["unbounded false"] + (degrees > 0.5)
    return _COLUMN["truth 0"] + np.digitize(degrees, TRUTH_EDGES)


def _describe_sought(table: NDArray[np.bool_], pairs: Pairs, objects: Objects) -> None:
    """Describes what is searched for: the figure, or the landmark of a place for the robot."""
    sought = np.where(pairs.figure == NONE, pairs.landmark, pairs.figure)
    found = np.flatnonzero(sought != NONE)
    seen_in = objects.world[np.unique(sought[found])]
    per_world = np.bincount(seen_in, minlength=len(objects.viewers))
    table[found, _COLUMN["only one of its class"]] = per_world[pairs.world[found]] == 1
    table[found, _COLUMN["hypothesised"]] = ~objects.observed[sought[found]]


def measure(relation: str, placement: Placement) -> Floats:
    """What a superlative makes smallest: "nearest" the distance, "leftmost" how far right (P,)."""
    return {
        "away": -placement.distance,
        "left": -placement.across,
        "right": placement.across,
        "front": placement.along,
        "back": -placement.along,
        "behind": -placement.along,
    }.get(relation, placement.distance)


def _ranks(pairs: Pairs, measured: Floats) -> Ints:
    """Rank by a measure of each figure among the figures of its hypothesis and landmark."""
    order = np.lexsort((measured, pairs.landmark, pairs.world))
    group = np.stack([pairs.world, pairs.landmark])[:, order]
    first = np.ones(len(order), dtype=np.bool_)
    first[1:] = (group[:, 1:] != group[:, :-1]).any(axis=0)
    at = np.arange(len(order))
    ranks = np.empty(len(order), dtype=np.int64)
    ranks[order] = at - np.maximum.accumulate(np.where(first, at, 0))
    return ranks


def prior(intent: Intent, pairs: Pairs, worlds: int) -> Floats:
    """Log prior of every pair: equal shares, but a superlative means one however many there are."""
    if intent.comparative:
        return np.zeros(len(pairs.world))
    return -np.log(np.bincount(pairs.world, minlength=worlds)[pairs.world])


def pair_probabilities(logits: Floats, world: Ints, worlds: int) -> tuple[Floats, Floats]:
    """Softmax over each hypothesis's pairs and "none": (of every pair, of none by hypothesis)."""
    odds: Floats = np.exp(np.minimum(logits, 50.0))
    totals: Floats = np.bincount(world, weights=odds, minlength=worlds).astype(np.float64)
    none: Floats = 1.0 / (1.0 + totals)
    return odds * none[world], none


def most_probable(probabilities: Floats, world: Ints, count: int) -> Ints:
    """Rows of the `count` most probable pairs of each hypothesis, hypothesis by hypothesis.

    Args:
        probabilities: of every pair (P,).
        world: hypothesis of every pair, ascending (P,).
        count: how many to keep.
    """
    if len(world) == 0 or np.bincount(world).max() <= count:
        return np.arange(len(world))
    order = np.lexsort((-probabilities, world))
    ranked = world[order]
    return order[np.arange(len(order)) - np.searchsorted(ranked, ranked) < count]
