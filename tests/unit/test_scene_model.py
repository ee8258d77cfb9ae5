"""The modelled recognition of places keeps to line of sight, and says how sure it may be."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely.ops

from robots.wheelchair.spec import WHEELCHAIR
from schemas.geometry import Pose2
from schemas.sensing import Odometry
from sim.experiments.scene_model import SceneModel, SceneSettings, confusion
from sim.experiments.sight import Walls
from sim.oracle import outline_of_region
from sim.scenes.model import Wall
from sim.world import make_world

WORLD = make_world("office", 0)
TYPES = tuple(name for name in WHEELCHAIR.symbols.locations if name != "generic")
STEP_NS = 1_000_000_000


def odometry(stamp_ns):
    return Odometry(
        stamp_ns=stamp_ns, odom_from_base=Pose2(0, 0, 0), linear=0.0, angular=0.0,
        variance_per_metre=0.0, variance_per_radian=0.0,
    )  # fmt: skip


def looks(poses, settings=None, seed=0):
    settings = settings or SceneSettings()
    rng = np.random.default_rng(seed)
    model = SceneModel(WORLD, WHEELCHAIR.symbols.locations, WHEELCHAIR.camera, settings, rng)
    return [model.observe(pose, odometry(n * STEP_NS)) for n, pose in enumerate(poses)]


def middle(name, yaw=0.0):
    x, y = WORLD.region(name).center
    return Pose2(x, y, yaw)


def test_every_row_is_a_distribution_over_the_types():
    for name in ("kitchen_1", "hallway_1", "lab_1"):
        (seen,) = looks([middle(name)])
        assert seen.types == TYPES
        assert len(seen.points_base) >= 1
        assert seen.probabilities.sum(axis=1) == pytest.approx(1.0)
        assert (seen.probabilities > 0).all()


def test_the_place_around_the_robot_is_always_spoken_of():
    (seen,) = looks([middle("kitchen_1")])
    assert (seen.points_base == 0).all(axis=1).sum() == 1


def test_what_is_behind_a_wall_is_not_seen():
    x, y = WORLD.region("kitchen_1").center
    turned = [Pose2(x, y, yaw) for yaw in np.linspace(-3, 3, 7)]
    for pose, seen in zip(turned, looks(turned), strict=True):
        ahead = seen.points_base[np.any(seen.points_base != 0, axis=1)]
        assert Walls(WORLD.walls).in_sight(pose, ahead).all()
        assert (np.hypot(*ahead.T) <= WHEELCHAIR.camera.range_max).all()
        assert (np.abs(np.arctan2(ahead[:, 1], ahead[:, 0])) <= math.radians(60)).all()
    # Nothing but the hallway outside the door can be seen from within the kitchen.
    assert max(len(seen.points_base) for seen in looks(turned)) == 2


def test_a_place_is_seen_through_its_door():
    kitchen, hall = (outline_of_region(WORLD.region(name)) for name in ("kitchen_1", "hallway_1"))
    threshold, _ = shapely.ops.nearest_points(hall, kitchen.centroid)
    into = np.array([kitchen.centroid.x - threshold.x, kitchen.centroid.y - threshold.y])
    into /= np.hypot(*into)
    x, y = np.array([threshold.x, threshold.y]) - 1.2 * into
    sure = SceneSettings(accuracy_near=1.0, accuracy_far=1.0)
    facing = Pose2(x, y, math.atan2(into[1], into[0]))
    turned_away = Pose2(x, y, math.atan2(-into[1], -into[0]))
    for pose, seen_through in ((facing, True), (turned_away, False)):
        (seen,) = looks([pose], sure)
        named = {seen.types[best] for best in seen.probabilities.argmax(axis=1)}
        assert "hallway" in named
        assert ("kitchen" in named) == seen_through


def test_stated_probabilities_are_those_of_the_errors():
    settings = SceneSettings(hold_m=0.0)
    seen = looks([middle("kitchen_1")] * 3000, settings)
    rows = np.array([one.probabilities[np.all(one.points_base == 0, axis=1)][0] for one in seen])
    truth = TYPES.index("kitchen")
    best = rows.argmax(axis=1)
    assert np.mean(best == truth) == pytest.approx(settings.accuracy_near, abs=0.02)
    kitchenlike = rows[best == truth]
    # Under even odds, a look that says "kitchen" is right as often as it claims.
    table = confusion(TYPES, settings.accuracy_near)
    assert kitchenlike[0, truth] == pytest.approx(
        table[truth, truth] / table[:, truth].sum(), abs=1e-9
    )


def test_another_look_from_the_same_spot_is_no_new_evidence():
    settings = replace(SceneSettings(), accuracy_near=0.2)
    seen = looks([middle("kitchen_1")] * 50, settings)
    assert len({one.probabilities.tobytes() for one in seen}) == 1
    x, y = WORLD.region("kitchen_1").center
    moving = [Pose2(x + 1.5 * (n % 2), y, 0.0) for n in range(50)]
    assert len({one.probabilities.tobytes() for one in looks(moving, settings)}) > 3


def test_confusion_rows_sum_to_one_and_hold_the_accuracy():
    table = confusion(TYPES, 0.7)
    assert table.sum(axis=1) == pytest.approx(1.0)
    assert np.diag(table) == pytest.approx(0.7)
    kitchen = table[TYPES.index("kitchen")]
    assert kitchen[TYPES.index("cafeteria")] > 3 * kitchen[TYPES.index("hallway")]


def test_rays_end_at_walls():
    walls = Walls((Wall(start=(2.0, -1.0), end=(2.0, 1.0), thickness=0.2),))
    reach = walls.reach(Pose2(0.0, 0.0, 0.0), np.array([0.0, 0.4, 1.0, math.pi]))
    assert reach[0] == pytest.approx(1.9)
    assert reach[1] == pytest.approx(1.9 / math.cos(0.4))
    assert np.isinf(reach[2:]).all()
    turned = walls.reach(Pose2(0.0, 0.0, 0.5), np.array([-0.5]))
    assert turned == pytest.approx([1.9])
    assert Walls(()).in_sight(Pose2(0, 0, 0), np.array([[5.0, 5.0]])).all()
