"""Scans tell how the robot moved where there are walls, and say nothing where there are none."""

import math

import numpy as np
import pytest

from schemas.geometry import Pose2
from schemas.sensing import LaserScan
from services.mapping.backbone import Backbone
from services.mapping.odometer import OdometryNoise
from services.mapping.scan_matching import match
from services.mapping.scan_memory import points_of

ORIGIN = Pose2(0.0, 0.0, 0.0)
ROOM = (
    (-3.0, -2.0, 5.0, -2.0),
    (5.0, -2.0, 5.0, 4.0),
    (5.0, 4.0, -3.0, 4.0),
    (-3.0, 4.0, -3.0, -2.0),
)
CORRIDOR = ((-40.0, -1.0, 40.0, -1.0), (-40.0, 1.0, 40.0, 1.0))
ANGLES = np.linspace(-math.pi, math.pi, 360, endpoint=False)


def scan(walls: tuple[tuple[float, ...], ...], pose: Pose2, seed: int = 0) -> LaserScan:
    """What a laser sees of walls (x0, y0, x1, y1) from a pose, with a centimetre of noise."""
    directions = np.stack([np.cos(ANGLES + pose.yaw), np.sin(ANGLES + pose.yaw)], axis=1)
    ranges = np.full(len(ANGLES), np.inf)
    for x0, y0, x1, y1 in walls:
        along, start = np.array([x1 - x0, y1 - y0]), np.array([x0 - pose.x, y0 - pose.y])
        cross = directions[:, 0] * along[1] - directions[:, 1] * along[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            way = (start[0] * along[1] - start[1] * along[0]) / cross
            share = (start[0] * directions[:, 1] - start[1] * directions[:, 0]) / cross
        hit = (way > 0.05) & (share >= 0) & (share <= 1) & (way < 20)
        ranges = np.where(hit, np.minimum(ranges, way), ranges)
    ranges = ranges + 0.01 * np.random.default_rng(seed).standard_normal(len(ranges))
    return LaserScan(
        stamp_ns=0,
        angle_min=-math.pi,
        angle_increment=2 * math.pi / 360,
        range_max=20.0,
        ranges=ranges.astype(np.float32),
        base_from_laser=ORIGIN,
        odom_from_base=pose,
    )


def seen(walls: tuple[tuple[float, ...], ...], pose: Pose2, seed: int = 0) -> np.ndarray:
    return points_of(scan(walls, pose, seed))


@pytest.mark.parametrize("seed", range(4))
def test_in_a_room_a_match_finds_the_step_and_how_sure_it_is(seed: int) -> None:
    rng = np.random.default_rng(seed)
    step = Pose2(*(rng.uniform(-1, 1, 3) * (1.0, 1.0, 0.6)).tolist())
    guess = step @ Pose2(*(rng.uniform(-1, 1, 3) * (0.25, 0.25, 0.1)).tolist())
    found = match(seen(ROOM, ORIGIN, 1), seen(ROOM, step, 2), guess)
    assert found is not None
    error = found.before_from_after.inverse() @ step
    assert math.hypot(error.x, error.y) < 0.02
    assert abs(error.yaw) < 0.005
    vector = np.array([error.x, error.y, error.yaw])
    assert vector @ np.linalg.solve(found.covariance, vector) < 16
    assert np.sqrt(np.diag(found.covariance)).max() < 0.05


def test_along_a_corridor_the_way_stays_as_it_was_guessed() -> None:
    guess = Pose2(0.8, 0.1, 0.05)
    found = match(seen(CORRIDOR, ORIGIN, 1), seen(CORRIDOR, Pose2(1.0, 0.0, 0.0), 2), guess)
    assert found is not None
    pose = found.before_from_after
    assert (pose.y, pose.yaw) == pytest.approx((0.0, 0.0), abs=0.02)
    # The ends of beams leave a trace of the way, which must not be believed.
    assert math.sqrt(found.covariance[1, 1]) < 0.03
    assert math.sqrt(found.covariance[0, 0]) > 10 * math.sqrt(found.covariance[1, 1])
    turned = match(
        seen(CORRIDOR, ORIGIN, 1), seen(CORRIDOR, Pose2(0.0, 0.0, 1.5), 2), Pose2(0.0, 0.0, 1.5)
    )
    assert turned is not None
    assert turned.covariance[1, 1] > 100 * turned.covariance[0, 0]


def test_a_few_things_on_open_ground_say_nothing() -> None:
    posts = tuple((x, y, x + 0.2, y + 0.2) for x, y in ((4.0, 1.0), (6.0, -2.0), (3.0, -3.0)))
    assert (
        match(seen(posts, ORIGIN), seen(posts, Pose2(0.5, 0.0, 0.0)), Pose2(0.5, 0.0, 0.0)) is None
    )
    nothing = np.zeros((0, 2))
    assert match(nothing, nothing, ORIGIN) is None
    assert match(seen(ROOM, ORIGIN), nothing, ORIGIN) is None


def test_another_place_is_refused() -> None:
    cave = tuple(
        (4 * math.cos(a), 3 * math.sin(a), 1.5 * math.cos(a + 0.5), 6 * math.sin(a + 0.5))
        for a in range(6)
    )
    assert match(seen(ROOM, ORIGIN), seen(cave, ORIGIN), ORIGIN) is None


def drive(use_scans: bool, walls: tuple[tuple[float, ...], ...]) -> float:
    """Error of the pose [m] after laps in a room, with odometry that turns too far."""
    backbone, true, odom = Backbone(ORIGIN, ORIGIN, np.zeros((0, 3))), ORIGIN, ORIGIN
    for step in range(120):
        move = Pose2(0.2, 0.0, 0.2 if step % 2 else 0.0)
        true, odom = true @ move, odom @ Pose2(0.202, 0.0, move.yaw * 1.05)
        if use_scans:
            backbone.scan(seen(walls, true, step), odom)
        backbone.move(odom, OdometryNoise(1e-3, 1e-3))
        if backbone.due(odom):
            assert backbone.extend(odom)
    error = backbone.locate(odom).inverse() @ true
    return math.hypot(error.x, error.y)


def test_scans_keep_the_pose_in_a_room() -> None:
    assert drive(False, ROOM) > 0.3
    assert drive(True, ROOM) < 0.1


def test_where_there_are_no_walls_scans_change_nothing() -> None:
    assert drive(True, ((100.0, 100.0, 101.0, 101.0),)) == drive(False, ())
