"""RRT* on the known map: free of collisions, nearly shortest, and the same for the same seed."""

import numpy as np
import pytest
import shapely

from robots.husky.spec import HUSKY
from schemas import topics
from schemas.arrays import Floats
from schemas.geometry import Pose2
from sim.experiments.reference_driver import ReferenceDriverNode
from sim.experiments.reference_path import NoReferencePathError, reference_path
from sim.oracle import shortest_path
from tests.unit.test_montecarlo_arms import heard, odometry

RADIUS = 0.5
WALLS = [shapely.box(4, -3, 5, 3), shapely.box(7, 0, 8, 9)]
START, END = (0.0, 0.0), (12.0, 1.0)


def length_of(corners: Floats) -> float:
    return float(np.hypot(*np.diff(corners, axis=0).T).sum())


@pytest.mark.parametrize("seed", [0, 7])
def test_the_path_is_free_and_hardly_longer_than_the_visibility_graphs(seed: int) -> None:
    path = reference_path(START, END, WALLS, RADIUS, 0.0, seed)
    assert path[0] == pytest.approx(START)
    assert path[-1] == pytest.approx(END)
    body = shapely.linestrings(path).buffer(RADIUS - 1e-3)
    assert not any(body.intersects(wall) for wall in WALLS)
    shortest = shortest_path(START, END, WALLS, RADIUS)
    assert shortest - 0.05 < length_of(path) < 1.04 * shortest


def test_a_seed_decides_the_path_whatever_was_planned_before() -> None:
    first = reference_path(START, END, WALLS, RADIUS, 0.0, 3)
    reference_path(START, END, WALLS, RADIUS, 0.0, 4)
    assert np.array_equal(first, reference_path(START, END, WALLS, RADIUS, 0.0, 3))


def test_with_nothing_in_the_way_it_is_straight_and_ends_short_of_the_thing() -> None:
    path = reference_path(START, END, [], RADIUS, 1.3, 0)
    straight = float(np.hypot(*END))
    assert float(np.hypot(*(path[-1] - END))) == pytest.approx(1.3, abs=1e-3)
    assert length_of(path) == pytest.approx(straight - 1.3, rel=5e-3)


def test_where_the_robot_stands_already_there_is_nothing_to_drive() -> None:
    assert length_of(reference_path((0.0, 0.0), (1.0, 0.0), [], RADIUS, 1.3, 0)) == 0.0


@pytest.mark.slow
def test_a_place_that_is_walled_in_is_said_to_have_no_way() -> None:
    ring = shapely.Point(*END).buffer(3.0).difference(shapely.Point(*END).buffer(2.5))
    with pytest.raises(NoReferencePathError, match=r"no way from \(0.0, 0.0\) to \(12.0, 1.0\)"):
        reference_path(START, END, [ring], RADIUS, 0.0, 0)


def test_the_driver_declares_the_end_of_the_path_and_not_before() -> None:
    pose = [Pose2(0.0, 0.0, 0.0)]
    corners = np.array([[0.0, 0.0], [4.0, 0.0]])
    node = ReferenceDriverNode(HUSKY, lambda: pose[0], lambda _: corners)
    list(node.on_annotations(heard()))
    (moving,) = node.on_odometry(odometry(1, pose[0]))
    assert moving.message.linear > 0.0
    pose[0] = Pose2(3.99, 0.01, 0.0)
    outputs = list(node.on_odometry(odometry(2, pose[0])))
    assert [output.topic for output in outputs] == [topics.BASE_COMMAND, topics.INSTRUCTION_STATUS]
    assert outputs[0].message.linear == 0.0
    assert not list(node.on_odometry(odometry(3, pose[0])))
