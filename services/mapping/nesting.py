"""Things that lie in others: two of them at one place are two, and the inner one hides there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from schemas.arrays import Flags, Floats
from services.mapping.objects import TrackedObject
from services.mapping.sensing import Picture

_smaller = 0.7
"""Share of the width of a box that a thing in it is smaller than."""


@dataclass(frozen=True)
class Build:
    """What decides whether one thing may lie in another, for N things."""

    width: Floats
    """(N,) The greatest [m]."""
    holds: Flags
    """(N,) Whether it is more likely something that others lie in than not."""


def build_of_picture(picture: Picture, containers: Sequence[int]) -> Build:
    """Of the detections of a picture.

    Args:
        picture: N detections.
        containers: indices of the classes that others may lie in.
    """
    return _build(picture.extents, picture.class_probability, containers)


def build_of_things(things: Sequence[TrackedObject], containers: Sequence[int]) -> Build:
    """Of things of the map, likewise."""
    extents = np.array([thing.extent for thing in things]).reshape(-1, 3)
    return _build(extents, np.array([thing.class_probability for thing in things]), containers)


def may_lie_in(inner: Build, outer: Build) -> Flags:
    """(N, K) Whether each thing of the first may lie in each of the others."""
    smaller = inner.width[:, None] < _smaller * outer.width
    return smaller & ~inner.holds[:, None] & outer.holds


def may_be_at_one_place(some: Build, others: Build) -> Flags:
    """(N, K) Whether one of two may lie in the other, so that they are two things."""
    return may_lie_in(some, others) | may_lie_in(others, some).T


def enclosed(things: Sequence[TrackedObject], containers: Sequence[int]) -> Flags:
    """(K,) Which things lie in others of them."""
    build = build_of_things(things, containers)
    means = np.array([thing.mean for thing in things]).reshape(-1, 2)
    gaps = np.linalg.norm(means[:, None] - means, axis=2)
    within: Flags = (may_lie_in(build, build) & (gaps < build.width / 2)).any(axis=1)
    return within


def _build(extents: Floats, classes: Floats, containers: Sequence[int]) -> Build:
    if not len(extents):
        return Build(np.zeros(0), np.zeros(0, np.bool_))
    holding = classes[:, list(containers)].sum(axis=1)
    return Build(extents[:, :2].max(axis=1), 2 * holding > classes.sum(axis=1))
