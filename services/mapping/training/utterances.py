"""The data set of spatial relations: which pair of things a person means by a word.

For every example an annotator is shown a scene of its own and given a word, and names the pair
that the word fits, better fits and larger landmarks more often. In a fifth of the examples for
words of sides and nearness the landmark is the robot itself. Annotators err as people do:
- a thing with a front of its own may lend its frame to the word (Levinson, 1996),
- "front" may be taken for the far side, as if the thing looked the same way as the viewer,
- left and right are mixed up now and then,
- and some answers have nothing to do with the word.
"""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from schemas.arrays import Flags, Floats, Ints
from services.mapping.training.acceptability import Degree, Pairs, degrees, of_robot
from services.mapping.training.scenes import Scenes, sample_scenes, things

_of_robot_share = 0.2
_robot_radius = 0.5
_own_frame, _mirrored, _slip, _careless = 0.15, 0.03, 0.015, 0.02
_sharpness = 2.0
"""Annotators choose a pair in proportion to this power of its degree."""
_hopeless = 0.05
"""Below this degree the best pair of a scene is no example."""
_opposite = {"front": "back", "back": "front", "left": "right", "right": "left"}
_sides = tuple(_opposite)
_Scalar = TypeVar("_Scalar", bound=np.generic)


@dataclass(frozen=True)
class Examples:
    """n pairs that were meant by one relation."""

    offset: Floats
    """(n, 2) u and v from landmark to figure [m]."""
    phi: Floats
    """(n, D) as `relations.features`."""

    def take(self, rows: Ints | Flags) -> "Examples":
        """Rows by index or mask."""
        return Examples(self.offset[rows], self.phi[rows])

    def joined(self, others: "Examples") -> "Examples":
        """These and others."""
        offset = np.concatenate([self.offset, others.offset])
        return Examples(offset, np.concatenate([self.phi, others.phi]))


def sample_examples(relation: str, count: int, rng: Generator) -> Examples:
    """Examples of a word, out of `count` scenes; those without a fitting pair yield none."""
    robot = round(_of_robot_share * count) if relation in of_robot else 0
    examples = _chosen(relation, sample_scenes(count - robot, rng), False, rng)
    if robot:
        return examples.joined(_chosen(relation, sample_scenes(robot, rng), True, rng))
    return examples


def _chosen(relation: str, scenes: Scenes, robot: bool, rng: Generator) -> Examples:
    """One pair from each scene."""
    pairs = _pairs_at_robot(scenes) if robot else _pairs(scenes)
    shape = (len(scenes.position), -1)
    degree = _judged(relation, pairs, scenes, robot, rng).reshape(shape)
    salience = np.sqrt(pairs.half.mean(axis=1)).reshape(shape)
    weight = (degree * _may_be_meant(scenes, robot)) ** _sharpness * salience
    fits = weight.max(axis=1) > _hopeless**_sharpness
    edges = np.cumsum(weight, axis=1)
    pick = np.argmax(edges > rng.random((shape[0], 1)) * edges[:, -1:], axis=1)
    rows = np.arange(len(pick)) * degree.shape[1] + pick
    return _examples(pairs, robot).take(rows[fits])


def _examples(pairs: Pairs, robot: bool) -> Examples:
    one = np.ones(len(pairs.offset))
    phi = [one, pairs.figure_radius, *pairs.half.T, pairs.distance, robot * one]
    return Examples(pairs.offset, np.stack(phi, axis=1))


def _judged(relation: str, pairs: Pairs, scenes: Scenes, robot: bool, rng: Generator) -> Floats:
    """Degrees (n,) in the eyes of annotators, one of them for each scene."""
    count = len(scenes.position)
    each = len(pairs.offset) // count
    degree = degrees[relation](pairs)
    if relation in _sides:
        slip = _mirrored if relation in ("front", "back") else _slip
        opposite = degrees[_opposite[relation]](pairs)
        degree = np.where(np.repeat(rng.random(count) < slip, each), opposite, degree)
        if not robot:
            own = np.repeat(rng.random(count) < _own_frame, each)
            degree = np.where(own, _in_own_frame(degrees[relation], pairs, scenes, degree), degree)
    careless = np.repeat(rng.random(count) < _careless, each)
    return np.where(careless, (pairs.gap > 0).astype(float), degree)


def _in_own_frame(judge: Degree, pairs: Pairs, scenes: Scenes, otherwise: Floats) -> Floats:
    """Degrees where the landmark's own front counts, as they were where it has none."""
    facing = np.tile(scenes.facing[:, None], (1, things, 1)).reshape(-1)
    # A thing that faces the viewer has its front where the viewer's "front" is.
    turn = np.nan_to_num(facing)
    c, s = np.cos(turn), np.sin(turn)
    u, v = pairs.offset.T
    turned = replace(pairs, offset=np.stack([c * u + s * v, c * v - s * u], axis=1))
    return np.where(np.isnan(facing), otherwise, judge(turned))


def _may_be_meant(scenes: Scenes, robot: bool) -> Floats:
    """1 for pairs of different things whose figure is not large (S, pairs of a scene)."""
    figure = scenes.kind < 2
    if robot:
        return figure.astype(float)
    different = ~np.eye(things, dtype=bool)
    return (figure[:, :, None] & different).reshape(len(figure), -1).astype(float)


def _pairs(scenes: Scenes) -> Pairs:
    """All pairs of a scene, figure by figure."""
    position = scenes.position
    distance = np.linalg.norm(position, axis=2)
    u = position / np.maximum(distance, 1e-6)[..., None]
    between = position[:, :, None] - position[:, None]
    along = np.einsum("sflx,slx->sfl", between, u)
    across = between[..., 1] * u[:, None, :, 0] - between[..., 0] * u[:, None, :, 1]
    apart = np.linalg.norm(between, axis=3)
    return Pairs(
        offset=np.stack([along, across], axis=-1).reshape(-1, 2),
        half=_for_each_figure(scenes.half).reshape(-1, 2),
        figure_radius=np.repeat(scenes.radius, things, axis=1).reshape(-1),
        distance=_for_each_figure(distance).reshape(-1),
        surroundings=_for_each_figure(_surroundings(apart)).reshape(-1),
        is_open=_for_each_figure(scenes.is_open).reshape(-1),
        is_nearest=_nearest(apart, scenes.label).reshape(-1),
    )


def _pairs_at_robot(scenes: Scenes) -> Pairs:
    """All figures of a scene against the robot, which may look anywhere."""
    position = scenes.position.reshape(-1, 2)
    n = len(position)
    distance = np.linalg.norm(scenes.position, axis=2)
    bearing = np.arctan2(position[:, 1], position[:, 0])
    # The sector of the scene is spread over all directions: there is no line of sight to it.
    around = bearing * np.pi / np.abs(bearing).max()
    offset = distance.reshape(-1, 1) * np.stack([np.cos(around), np.sin(around)], axis=1)
    rivals = np.sort(distance, axis=1)[:, :3].mean(axis=1)
    return Pairs(
        offset=offset,
        half=np.full((n, 2), _robot_radius),
        figure_radius=scenes.radius.reshape(-1),
        distance=np.zeros(n),
        surroundings=np.repeat(rivals, things),
        is_open=np.zeros(n, np.bool_),
        is_nearest=np.zeros(n, np.bool_),
    )


def _for_each_figure(of_landmark: NDArray[_Scalar]) -> NDArray[_Scalar]:
    """(S, N, ...) as (S, figures, N, ...)."""
    return np.repeat(of_landmark[:, None], things, axis=1)


def _surroundings(apart: Floats) -> Floats:
    """(S, N) mean distance to the three nearest others."""
    return np.sort(apart, axis=1)[:, 1:4].mean(axis=1)


def _nearest(apart: Floats, label: Ints) -> Flags:
    """(S, figures, landmarks) whether a figure is the nearest of several of its class."""
    same = (label[:, :, None] == label[:, None]) & ~np.eye(things, dtype=bool)
    rivals = np.where(same[..., None], apart[:, None], np.inf)
    # A thing is no rival for the place beside itself.
    rivals = np.where(np.eye(things, dtype=bool)[None, None], np.inf, rivals)
    best = rivals.min(axis=2)
    return np.isfinite(best) & (apart < best)
