import hashlib
import math

import msgspec
import numpy as np
import pytest

pytest.importorskip("sapien")

from robots.driver import RobotDriver
from robots.husky.spec import HUSKY
from schemas.geometry import Pose2
from schemas.motion import BaseCommand
from schemas.sensing import JointState, LaserScan, Odometry
from sim.driver import SapienDriver
from sim.oracle import Oracle
from sim.scenes.model import Ground, PlacedObject, Sun, World
from sim.sensors import beam_angles, measured_depth
from sim.world import make_world


def world_of(*objects, name="test"):
    return World(
        name=name,
        seed=0,
        ground=Ground(kind="grass", look=0),
        sun=Sun(azimuth=0.0, elevation=1.0),
        world_from_start=Pose2(0.0, 0.0, 0.0),
        objects=tuple(
            PlacedObject(id=f"{label}_{i}", label=label, look=1, world_from_object=Pose2(x, y, yaw))
            for i, (label, x, y, yaw) in enumerate(objects)
        ),
    )


def drive(driver, linear, angular, seconds):
    """Drive with a fresh command every 0.1 s and return the readings."""
    readings = []
    for _ in range(round(seconds * 10)):
        driver.command(
            BaseCommand(stamp_ns=driver.stamp_ns, linear=linear, angular=angular, valid_ms=200)
        )
        readings += driver.step(driver.stamp_ns + 100_000_000)
    return readings


def numbers(pose):
    return pose.x, pose.y, pose.yaw


def digest(readings):
    encoder = msgspec.msgpack.Encoder(enc_hook=lambda array: array.tobytes())
    return hashlib.sha256(b"".join(encoder.encode(reading) for reading in readings)).hexdigest()


def make_driver(world, seed=0) -> RobotDriver:
    return SapienDriver(HUSKY, world, seed, camera=False)


def test_same_seed_same_bytes_and_another_seed_differs():
    world = make_world("hydrant", 3)
    first, again, other = (drive(make_driver(world, s), 0.6, 0.3, 2.0) for s in (1, 1, 2))
    assert digest(first) == digest(again)
    assert digest(first) != digest(other)


@pytest.mark.parametrize(("linear", "angular"), [(1.0, 0.0), (0.0, 1.0), (0.5, 0.5)])
def test_the_base_follows_its_command(linear, angular):
    driver = make_driver(world_of())
    drive(driver, linear, angular, 1.0)
    before = driver.world_from_base
    drive(driver, linear, angular, 1.0)
    motion = before.inverse() @ driver.world_from_base
    assert math.hypot(motion.x, motion.y) == pytest.approx(linear, abs=0.06)
    assert motion.yaw == pytest.approx(angular, abs=0.06)


def test_sensors_read_at_their_rates_in_order_of_time():
    readings = drive(make_driver(world_of()), 0.2, 0.0, 2.0)
    counts = {
        kind: sum(isinstance(r, kind) for r in readings)
        for kind in (Odometry, JointState, LaserScan)
    }
    assert counts == {Odometry: 40, JointState: 20, LaserScan: round(2 * HUSKY.laser.rate_hz)}
    stamps = [reading.stamp_ns for reading in readings]
    assert stamps == sorted(stamps)


def test_the_base_stops_when_commands_stop_and_when_latched():
    driver = make_driver(world_of())
    drive(driver, 1.0, 0.0, 1.0)
    driver.step(driver.stamp_ns + 1_000_000_000)
    resting = driver.world_from_base
    driver.latch_stop(True)
    assert driver.stopped
    drive(driver, 1.0, 0.0, 1.0)
    assert numbers(driver.world_from_base) == pytest.approx(numbers(resting), abs=1e-3)


def test_an_obstacle_stops_the_base():
    world = world_of(("barrel", 1.5, 0.0, 0.0))
    driver = make_driver(world)
    drive(driver, 1.0, 0.0, 3.0)
    assert 0.4 < driver.world_from_base.x < 0.9
    assert Oracle(world, HUSKY.base, lambda: driver.world_from_base).clearance() < 0.03


def test_wheels_turn_with_the_way():
    driver = make_driver(world_of())
    readings = drive(driver, 0.5, 0.0, 2.0)
    joints = [reading for reading in readings if isinstance(reading, JointState)][-1]
    assert joints.names[0] == "front_left_wheel"
    assert joints.positions * HUSKY.base.wheel_radius == pytest.approx(
        driver.world_from_base.x, abs=0.08
    )


def test_the_laser_sees_a_building_where_it_stands():
    world = world_of(("wall", 5.0, 0.0, 0.0))
    scan = [r for r in drive(make_driver(world), 0.0, 0.0, 0.2) if isinstance(r, LaserScan)][-1]
    angles = beam_angles(HUSKY.laser)
    ahead = int(np.argmin(np.abs(angles)))
    face = 5.0 - 0.125 - HUSKY.laser.base_from_laser.x
    assert scan.ranges[ahead] == pytest.approx(face, abs=0.06)
    assert np.isinf(scan.ranges[np.abs(angles) > math.pi / 2]).all()
    side = int(np.argmin(np.abs(angles - 0.2)))
    assert scan.ranges[side] * math.cos(angles[side]) == pytest.approx(face, abs=0.06)


def test_odometry_drifts_from_the_truth_but_not_far():
    driver = make_driver(world_of(), seed=5)
    last = [r for r in drive(driver, 1.0, 0.0, 8.0) if isinstance(r, Odometry)][-1]
    error = driver.world_from_base.inverse() @ last.odom_from_base
    assert 1e-4 < math.hypot(error.x, error.y) < 0.4


def test_a_restored_driver_goes_on_where_the_other_was():
    world = make_world("hydrant", 3)
    first, second = make_driver(world), make_driver(world)
    drive(first, 0.5, 0.2, 1.0)
    second.restore(first.checkpoint())
    assert second.stamp_ns == first.stamp_ns
    assert second.world_from_base == first.world_from_base
    drive(first, 0.5, 0.2, 0.5)
    drive(second, 0.5, 0.2, 0.5)
    expected = numbers(first.world_from_base)
    assert numbers(second.world_from_base) == pytest.approx(expected, abs=1e-3)


def test_a_wrong_checkpoint_is_refused():
    driver = make_driver(world_of())
    with pytest.raises(ValueError, match="not a checkpoint"):
        driver.restore(b"rubbish")
    with pytest.raises(ValueError, match="other"):
        driver.restore(make_driver(world_of(name="other")).checkpoint())


def test_depth_noise_grows_with_distance_and_nothing_is_beyond_the_range():
    flat = np.full((240, 320), 2.0, np.float32)
    rng = np.random.default_rng(0)
    limit = HUSKY.camera.range_max
    near, far = (measured_depth(flat * k, limit, rng).astype(float) for k in (1, 3))
    assert near[near > 0].mean() == pytest.approx(2000, abs=2)
    assert near[near > 0].std() < far[far > 0].std()
    assert not measured_depth(flat * 5, HUSKY.camera.range_max, rng).any()
    assert not measured_depth(flat * 0, HUSKY.camera.range_max, rng).any()
