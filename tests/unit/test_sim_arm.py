"""The arm in the simulator: what the driver lets through, and how the body follows."""

import numpy as np
import pytest

pytest.importorskip("sapien")

from robots.arm_kinematics import forward, link_frames
from robots.husky.spec import HUSKY
from robots.husky_ur5.spec import HUSKY_UR5, UR5
from schemas.errors import UserError
from schemas.geometry import Pose2
from schemas.motion import ArmCommand, BaseCommand, GripperCommand
from schemas.sensing import JointState, LaserScan
from sim.arm_governor import ArmGovernor, GripperGovernor
from sim.driver import SapienDriver
from sim.sensors import hull_ranges
from tests.unit.test_sim_driver import digest, world_of

STOW, LOOK = (np.array(UR5.poses[name]) for name in ("stow", "look"))
NOTHING: dict = {}


def motion(start=STOW, end=LOOK, seconds=2.0, name="m", **changes) -> ArmCommand:
    """A smooth motion from rest to rest."""
    u = np.linspace(0, 1, 41)[:, None]
    fields = {
        "stamp_ns": 0,
        "id": name,
        "times": u[:, 0] * seconds,
        "positions": start + (3 * u**2 - 2 * u**3) * (end - start),
        "velocities": (6 * u - 6 * u**2) * (end - start) / seconds,
        "valid_ms": 250,
    }
    return ArmCommand(**(fields | changes))


def governed(command: ArmCommand, seconds: float, until: float = np.inf) -> np.ndarray:
    """Setpoints (T, 6) of every tick of 10 ms; the command is sent until a time [s]."""
    governor = ArmGovernor(UR5.limits, STOW)
    made = []
    for tick in range(round(seconds * 100)):
        if tick % 5 == 0 and tick / 100 < until:
            governor.take(command, tick * 10_000_000)
        made.append(governor.advance(tick * 10_000_000, 0.01).positions)
    return np.array(made)


def apart_from_way(setpoints: np.ndarray) -> float:
    """How far setpoints lie from the straight way in joint space [rad]."""
    along = (LOOK - STOW) / np.linalg.norm(LOOK - STOW)
    gaps = setpoints - STOW
    return float(np.abs(gaps - (gaps @ along)[:, None] * along).max())


def test_a_motion_within_the_limits_is_followed_in_its_time() -> None:
    setpoints = governed(motion(), 2.2)
    np.testing.assert_allclose(setpoints[-1], LOOK)
    np.testing.assert_allclose(setpoints[99], motion().positions[20], atol=0.02)


def test_a_motion_that_is_too_fast_is_slowed_down_on_its_way() -> None:
    setpoints = governed(motion(seconds=0.3), 4.0)
    speeds = np.abs(np.diff(setpoints, axis=0)) / 0.01
    assert (speeds.max(axis=0) <= np.array(UR5.limits.speed) + 1e-6).all()
    assert apart_from_way(setpoints) < 1e-9
    np.testing.assert_allclose(setpoints[-1], LOOK)


def test_the_arm_comes_to_rest_on_its_way_when_commands_cease_and_stays() -> None:
    setpoints = governed(motion(), 3.0, until=0.8)
    still = np.abs(np.diff(setpoints[-120:], axis=0)).max()
    assert still == 0
    assert apart_from_way(setpoints) < 1e-9
    assert 0.2 < np.abs(setpoints[-1] - STOW).max() < np.abs(LOOK - STOW).max()


def test_a_stop_holds_and_its_release_brings_nothing_back() -> None:
    governor = ArmGovernor(UR5.limits, STOW)
    made = []
    for tick in range(300):
        if tick in (60, 150):
            governor.latch(tick == 60)
        governor.take(motion(), tick * 10_000_000)
        made.append(governor.advance(tick * 10_000_000, 0.01).positions)
    resting = made[60 + round(UR5.limits.stop_s * 100) + 1]
    np.testing.assert_array_equal(resting, made[-1])


@pytest.mark.parametrize(
    "wrong",
    [
        motion(start=STOW + 0.2),
        motion(end=STOW + 7.0),
        motion(times=np.zeros(41)),
        motion(positions=np.full((41, 6), np.nan)),
        motion(positions=np.zeros((41, 5))),
        motion(times=np.array([0.0]), positions=STOW[None], velocities=np.zeros((1, 6))),
    ],
    ids=["elsewhere", "beyond limits", "no time", "no numbers", "five joints", "one point"],
)
def test_what_the_arm_may_not_do_is_not_begun(wrong: ArmCommand) -> None:
    np.testing.assert_array_equal(governed(wrong, 1.0)[-1], STOW)


def test_a_moving_arm_begins_nothing_else() -> None:
    governor = ArmGovernor(UR5.limits, STOW)
    for tick in range(100):
        governor.take(motion(), tick * 10_000_000)
        here = governor.advance(tick * 10_000_000, 0.01).positions
    governor.take(motion(start=here, end=STOW, name="other"), 1_000_000_000)
    assert governor.advance(1_000_000_000, 0.01).velocities @ (LOOK - STOW) > 0


def test_the_gripper_keeps_to_its_speed_and_its_range_and_holds_at_a_stop() -> None:
    governor = GripperGovernor(UR5.gripper, 0.0)
    governor.take(GripperCommand(stamp_ns=0, opening=5.0))
    gaps = [governor.advance(0.01) for _ in range(30)]
    assert max(np.diff(gaps)) <= UR5.gripper.speed * 0.01 + 1e-12
    governor.latch(True)
    governor.take(GripperCommand(stamp_ns=0, opening=0.0))
    held = governor.advance(0.01)
    assert held == gaps[-1]
    governor.latch(False)
    assert governor.advance(0.01) == held
    governor.take(GripperCommand(stamp_ns=0, opening=5.0))
    for _ in range(200):
        governor.advance(0.01)
    assert governor.opening == UR5.gripper.opening


def make_driver(*objects, seed=0) -> SapienDriver:
    return SapienDriver(HUSKY_UR5, world_of(*objects), seed, camera=False)


def carry_out(driver: SapienDriver, command: ArmCommand, seconds: float) -> list:
    readings: list = []
    for _ in range(round(seconds * 20)):
        driver.command_arm(command)
        readings += driver.step(driver.stamp_ns + 50_000_000)
    return readings


def joints_of(readings: list) -> JointState:
    return [reading for reading in readings if isinstance(reading, JointState)][-1]


def test_the_arm_goes_where_it_is_sent_and_the_base_stays() -> None:
    driver = make_driver()
    state = joints_of(carry_out(driver, motion(), 2.5))
    assert state.names[4:] == (*UR5.joints, *UR5.fingers)
    np.testing.assert_allclose(state.positions[4:10], LOOK, atol=5e-3)
    assert np.hypot(driver.world_from_base.x, driver.world_from_base.y) < 2e-3


def test_the_body_is_where_the_kinematics_say() -> None:
    driver = make_driver()
    positions = joints_of(carry_out(driver, motion(), 2.5)).positions[4:10]
    links = {link.name: link for link in driver.scene.get_all_articulations()[0].links}
    base = np.asarray(links["chassis"].entity_pose.to_transformation_matrix())
    frames = base @ _base_from_foot() @ link_frames(UR5, positions)
    for index, name in enumerate(UR5.joints):
        body = links[name].entity_pose.to_transformation_matrix()
        np.testing.assert_allclose(body, frames[index + 1], atol=1e-4)


def _base_from_foot() -> np.ndarray:
    made = np.eye(4)
    made[:3, :3] = UR5.base_from_foot.rotation()
    made[:3, 3] = UR5.base_from_foot.position
    return made


def test_a_jammed_joint_shows_in_what_the_driver_reports() -> None:
    driver = make_driver()
    driver.jam_joint("elbow")
    positions = joints_of(carry_out(driver, motion(), 2.5)).positions[4:10]
    off = np.abs(positions - LOOK)
    assert off[2] > 0.5
    assert np.delete(off, 2).max() < 0.1


def test_a_stop_holds_the_arm_and_what_is_in_the_gripper() -> None:
    driver = make_driver()
    driver.command_gripper(GripperCommand(stamp_ns=0, opening=0.1))
    carry_out(driver, motion(), 1.0)
    driver.latch_stop(True)
    driver.step(driver.stamp_ns + 1_000_000_000)
    before = joints_of(list(driver.step(driver.stamp_ns + 100_000_000))).positions
    after = joints_of(carry_out(driver, motion(), 1.0)).positions
    np.testing.assert_allclose(after, before, atol=1e-3)
    assert after[10:].sum() == pytest.approx(0.1, abs=2e-3)


def test_a_robot_without_an_arm_refuses_to_move_one() -> None:
    driver = SapienDriver(HUSKY, world_of(), 0, camera=False)
    with pytest.raises(UserError, match="'husky' has no arm"):
        driver.command_arm(motion())


def test_same_commands_same_bytes_and_a_checkpoint_goes_on_from_there() -> None:
    first, again = (carry_out(make_driver(("ball", 1.0, 0.0, 0.0)), motion(), 1.0) for _ in "ab")
    assert digest(first) == digest(again)
    driver, other = make_driver(("ball", 1.0, 0.0, 0.0)), make_driver(("ball", 1.0, 0.0, 0.0))
    carry_out(driver, motion(), 3.0)
    other.restore(driver.checkpoint())
    there = joints_of(list(other.step(other.stamp_ns + 100_000_000)))
    np.testing.assert_allclose(there.positions[4:10], LOOK, atol=5e-3)
    # And it can be sent on from there.
    back = joints_of(carry_out(other, motion(LOOK, STOW, name="back"), 2.5))
    np.testing.assert_allclose(back.positions[4:10], STOW, atol=5e-3)


def test_low_range_finders_see_a_box_all_round_and_not_the_robot() -> None:
    scans = make_driver().step(200_000_000)
    empty = [reading for reading in scans if isinstance(reading, LaserScan)][-1]
    assert not np.isfinite(empty.ranges).any()
    driver = make_driver(("box", 1.5, 0.0, 0.0), ("box", -1.5, 0.0, 0.0))
    scan = [r for r in driver.step(200_000_000) if isinstance(r, LaserScan)][-1]
    ahead, behind = scan.ranges[180], scan.ranges[0]
    assert 1.2 < ahead < 1.4
    assert 1.2 < behind < 1.4


def test_beams_leave_the_hull_where_it_ends() -> None:
    assert not hull_ranges(HUSKY.laser, HUSKY.base).any()
    skipped = hull_ranges(HUSKY_UR5.laser, HUSKY_UR5.base)
    base = HUSKY_UR5.base
    assert skipped[180] == pytest.approx(base.length / 2, abs=0.02)
    assert skipped[270] == pytest.approx(base.width / 2, abs=0.02)


def test_small_things_are_loose_where_there_is_an_arm_to_move_them() -> None:
    driver = make_driver(("cracker box", 1.2, 0.0, 0.0))
    assert driver.loose is not None
    for _ in range(30):
        driver.command(BaseCommand(stamp_ns=0, linear=0.6, angular=0.0, valid_ms=300))
        driver.step(driver.stamp_ns + 100_000_000)
    # The base pushes it along instead of being stopped by it.
    assert driver.loose.poses["cracker box_0"].position[0] > 1.3


def test_the_named_poses_keep_the_hand_where_they_say() -> None:
    hands = {name: forward(UR5, np.array(pose))[:3, 3] for name, pose in UR5.poses.items()}
    base_from = {name: UR5.base_from_foot.apply(at) for name, at in hands.items()}
    half = HUSKY_UR5.base.length / 2
    assert base_from["stow"][0] < half
    assert base_from["look"][2] > base_from["stow"][2]
    assert Pose2(0.0, 0.0, 0.0).apply(base_from["carry"][:2])[0] > half
