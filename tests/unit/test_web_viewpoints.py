import math

import pytest
from numpy.testing import assert_allclose

from schemas.geometry import Pose2
from web.viewpoints import VIEWPOINTS, viewpoint


def test_following_keeps_the_robot_in_front_and_top_keeps_north_up():
    east, north = Pose2(3.0, 1.0, 0.0), Pose2(3.0, 1.0, math.pi / 2)
    position, target = viewpoint("Robot", north)
    assert position[1] < 1.0 < target[1]
    assert_allclose(position[0], 3.0, atol=1e-9)
    for a, b in zip(viewpoint("Top", east), viewpoint("Top", north), strict=True):
        assert_allclose(a, b)


@pytest.mark.parametrize("name", VIEWPOINTS)
def test_nobody_looks_up_from_below_the_floor(name):
    position, target = viewpoint(name, Pose2(1.0, 2.0, 0.3))
    assert position[2] > target[2] >= 0
