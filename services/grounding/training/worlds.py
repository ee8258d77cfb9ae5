"""Sampled maps with a known answer, to learn what makes a pair of objects the one that is meant."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from services.grounding.behavior import Objects, candidates, place
from services.grounding.spatial import DENSITY
from services.grounding.symbols import ROBOT
from services.grounding.understanding import UNKNOWN, Intent
from services.grounding.world import WorldObjects

FIGURE, LANDMARK = "figure", "landmark"
NAMES = (FIGURE, LANDMARK)
"""Stand-ins for any two classes: the pair model knows nothing of particular ones."""
OF_ROBOT = ("near", "away", "front", "back", "behind", "left", "right")
"""Relations that people use with the robot itself as the landmark."""
HALF_WIDTH = 12.0
"""Maps are squares of twice this edge around the robot [m]."""
OF_ROOMS = ("inside", "down", "through", "past", "towards", "around")
"""Relations whose landmark is often a place."""
SHARE_ROOMS = 0.5
"""How often it then is as large as a room or a hallway."""
PROPOSALS = 200
SHARE_IN_MAP = 0.9
"""How often the object that is meant is in the map."""
SHARE_HYPOTHESISED = 0.4
"""How often it is there only because the language put it there."""
SHARE_DOUBLED = 0.4
"""How often the language has put another one there although it had been seen."""


@dataclass(frozen=True)
class Trial:
    """One map with the object that an intent means."""

    intent: Intent
    world: WorldObjects
    answer: int | None
    """Row of the figure (of the landmark if the robot is placed), None if the map lacks it."""


def sample_trial(relations: tuple[str, ...], rng: Generator) -> Trial:
    """Draws an intent and a map: what is meant, others like it, landmarks, wrong hypotheses."""
    intent = _sample_intent(relations, rng)
    world = _sample_world(SHARE_ROOMS if intent.relation in OF_ROOMS else 0.0, rng)
    if intent.object == ROBOT:
        meant = int(rng.choice(np.flatnonzero(world.classes == 1)))
    elif intent.comparative:
        meant = _nearest(intent, world)
    else:
        meant = 0
        world.positions[meant] = _sample_place(intent, world, rng)
    world.observed[meant] = rng.uniform() > SHARE_HYPOTHESISED
    if world.observed[meant] and not intent.comparative and rng.uniform() < SHARE_DOUBLED:
        world = _doubled(intent, world, meant, rng)
    if rng.uniform() > SHARE_IN_MAP:
        return Trial(intent, _without(world, meant), None)
    return Trial(intent, world, meant)


def _sample_intent(relations: tuple[str, ...], rng: Generator) -> Intent:
    figure = ROBOT if rng.uniform() < 0.1 else FIGURE
    relation = str(rng.choice([UNKNOWN, "near", *relations] if figure == FIGURE else relations))
    of_robot = figure == FIGURE and relation in OF_ROBOT and rng.uniform() < 0.3
    landmark = ROBOT if of_robot else LANDMARK
    landmark = UNKNOWN if relation == UNKNOWN else landmark
    comparative = figure == FIGURE and relation == "near" and rng.uniform() < 0.6
    return Intent(1.0, "", figure, UNKNOWN, relation, landmark, comparative)


def _sample_world(share_rooms: float, rng: Generator) -> WorldObjects:
    figures, landmarks = int(rng.integers(1, 5)), int(rng.integers(1, 3))
    count = figures + landmarks
    places = rng.uniform(-HALF_WIDTH, HALF_WIDTH, (count, 2))
    return WorldObjects(
        classes=np.repeat([0, 1], [figures, landmarks]),
        positions=np.column_stack([places, np.zeros(count)]),
        extents=_sample_extents(figures, landmarks, share_rooms, rng),
        observed=np.ones(count, dtype=np.bool_),
        viewer=np.array([*rng.uniform(-2.0, 2.0, 2), rng.uniform(-np.pi, np.pi)]),
    )


def _sample_extents(
    figures: int, landmarks: int, share_rooms: float, rng: Generator
) -> NDArray[np.float64]:
    """Edges of the boxes [m] (N, 3); a share of the landmarks is as large or long as a room."""
    extents = np.repeat(rng.uniform(0.3, 2.0, (figures + landmarks, 1)), 3, axis=1)
    rooms = rng.uniform(size=landmarks) < share_rooms
    extents[figures:][rooms] = rng.uniform(2.0, 12.0, (int(rooms.sum()), 3))
    return extents


def _nearest(intent: Intent, world: WorldObjects) -> int:
    objects = Objects.join((world,))
    pairs = candidates(intent, objects, NAMES)
    return int(pairs.figure[np.argmin(place(intent, pairs, objects).distance)])


def _sample_place(intent: Intent, world: WorldObjects, rng: Generator) -> NDArray[np.float64]:
    """A place (3,) drawn from the relation's own density around the first landmark."""
    landmark = np.flatnonzero(world.classes == 1)[:1]
    places = rng.uniform(-HALF_WIDTH, HALF_WIDTH, (PROPOSALS, 2))
    if intent.relation == "inside":
        # So small a share of the map that proposals from all of it would miss.
        half = 0.5 * world.extents[landmark, :2]
        places = world.positions[landmark, :2] + rng.uniform(-half, half, (PROPOSALS, 2))
    positions = np.column_stack([places, np.zeros(PROPOSALS)])
    if intent.relation == UNKNOWN:
        return positions[0]
    probe = WorldObjects(
        classes=np.append(np.zeros(PROPOSALS, dtype=np.int64), 1),
        positions=np.vstack([positions, world.positions[landmark]]),
        extents=np.repeat(world.extents[[0, landmark[0]]], [PROPOSALS, 1], axis=0),
        observed=np.ones(PROPOSALS + 1, dtype=np.bool_),
        viewer=world.viewer,
    )
    objects = Objects.join((probe,))
    pairs = candidates(intent, objects, NAMES)
    density = DENSITY[intent.relation](place(intent, pairs, objects)) + 1e-12
    return positions[rng.choice(pairs.figure, p=density / density.sum())]


def _doubled(intent: Intent, world: WorldObjects, meant: int, rng: Generator) -> WorldObjects:
    """Adds a wrong hypothesis of what is meant, placed as the language says."""
    where = rng.uniform(-HALF_WIDTH, HALF_WIDTH, 3)
    if intent.object != ROBOT:
        where = _sample_place(intent, world, rng)
    return WorldObjects(
        np.append(world.classes, world.classes[meant]),
        np.vstack([world.positions, where]),
        np.vstack([world.extents, world.extents[meant]]),
        np.append(world.observed, False),
        world.viewer,
    )


def _without(world: WorldObjects, row: int) -> WorldObjects:
    kept = np.arange(len(world.classes)) != row
    return WorldObjects(
        world.classes[kept],
        world.positions[kept],
        world.extents[kept],
        world.observed[kept],
        world.viewer,
    )
