"""Where a thing is that nobody saw, after looking at a part of where it may be."""

import numpy as np

from schemas.arrays import Floats
from schemas.geometry import Pose2
from services.mapping import relations
from services.mapping.annotations import Reading
from services.mapping.grid import Grid
from services.mapping.objects import columns
from services.mapping.relation_table import relation_named
from services.mapping.target import Evidence, left_for

BEHIND = Reading(0.0, 1, relation_named("back", False), 0, False)
POINTS = np.random.default_rng(5).uniform(-9.0, 9.0, (200, 2))


def looked_west_of(x: float) -> Evidence:
    """The ground was looked at, well, wherever it lies west of x [m]."""
    grid = Grid((0.0, 0.0))
    _, column = np.indices(grid.looked.shape)
    west = column * 0.2 + grid.origin[0] < x
    grid.looked[west] = np.log(0.002)
    classes = ("cone", "hydrant")
    return Evidence(classes, columns([], 2), grid, Pose2(0.0, 0.0, 0.0), (BEHIND,))


def moved(x: float) -> Floats:
    return left_for(POINTS, 1, looked_west_of(x)) - POINTS


def test_where_nobody_looked_and_where_all_was_looked_at_things_stay() -> None:
    for x in (-30.0, 30.0):
        np.testing.assert_allclose(moved(x), 0.0, atol=1e-9)


def test_what_was_looked_at_in_part_is_thought_in_the_rest() -> None:
    step = moved(0.0)
    at_edge = np.abs(POINTS[:, 0]) < 0.9 * relations.residual
    assert at_edge.any()
    assert (step[at_edge, 0] > 0.1).all()
    np.testing.assert_allclose(step[:, 1], 0.0, atol=1e-9)
    far = np.abs(POINTS[:, 0]) > relations.residual + 0.2
    np.testing.assert_allclose(step[far], 0.0, atol=1e-9)


def test_nothing_is_moved_further_than_the_relation_leaves_open() -> None:
    assert np.linalg.norm(moved(0.0), axis=1).max() <= np.sqrt(2) * relations.residual + 1e-9
