"""A unicycle with the Husky's limits, a perfect laser and the navigator in a closed loop."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from robots.husky.spec import HUSKY
from robots.wheelchair.spec import WHEELCHAIR
from schemas.belief import OccupancyGrid
from schemas.geometry import Pose2, wrap_angle
from schemas.sensing import LaserScan, Odometry
from schemas.task import Goal, TaskState
from services.navigation.follower import Velocity, standstill
from services.navigation.navigator import Navigator
from services.navigation.obstacle_stop import allowed, towards_room, turning

STEP_NS = 50_000_000
RESOLUTION = 0.1
ORIGIN = (-5.0, -5.0)


def goal_at(x: float, y: float, yaw: float = 0.0, *, face: bool = True, name: str = "g") -> Goal:
    return Goal(
        stamp_ns=0,
        id=name,
        instruction_id="i",
        map_from_goal=Pose2(x, y, yaw),
        tolerance=0.25,
        face=face,
        speed_limit=0.8,
    )


@dataclass
class Rig:
    """The closed loop; `truth` is what the laser sees, `occupied` what the grid shows."""

    truth: np.ndarray
    occupied: np.ndarray
    pose: Pose2 = field(default_factory=lambda: Pose2(0.0, 0.0, 0.0))
    moving: Velocity = standstill
    stamp_ns: int = 0
    scans: bool = True
    navigator: Navigator = field(default_factory=lambda: Navigator(HUSKY))
    poses: list[Pose2] = field(default_factory=list)
    commands: list[Velocity] = field(default_factory=list)

    def scan(self) -> LaserScan:
        lidar = self.pose @ HUSKY.laser.base_from_laser
        angles = lidar.yaw + np.arange(360) * np.pi / 180
        reach = np.arange(0.1, 12.0, 0.05)
        x = lidar.x + np.cos(angles)[:, None] * reach - ORIGIN[0]
        y = lidar.y + np.sin(angles)[:, None] * reach - ORIGIN[1]
        rows = np.clip((y / RESOLUTION).astype(int), 0, self.truth.shape[0] - 1)
        columns = np.clip((x / RESOLUTION).astype(int), 0, self.truth.shape[1] - 1)
        hit = self.truth[rows, columns]
        ranges = np.where(hit.any(axis=1), reach[hit.argmax(axis=1)], np.inf)
        return LaserScan(
            stamp_ns=self.stamp_ns,
            angle_min=0.0,
            angle_increment=np.pi / 180,
            range_max=20.0,
            ranges=ranges.astype(np.float32),
            base_from_laser=HUSKY.laser.base_from_laser,
            odom_from_base=self.pose,
        )

    def tick(self):
        self.stamp_ns += STEP_NS
        tenth = self.stamp_ns // STEP_NS
        if tenth % 10 == 1:
            self.navigator.take_grid(
                OccupancyGrid(
                    stamp_ns=self.stamp_ns,
                    origin=ORIGIN,
                    resolution=RESOLUTION,
                    occupancy=np.where(self.occupied, 40, -20).astype(np.int8),
                    looked=np.zeros(self.occupied.shape, np.int8),
                )
            )
            self.navigator.take_localisation(Pose2(0.0, 0.0, 0.0))
        if self.scans and tenth % 2 == 0:
            self.navigator.take_scan(self.scan())
        step = self.navigator.step(
            Odometry(
                stamp_ns=self.stamp_ns,
                odom_from_base=self.pose,
                linear=self.moving.linear,
                angular=self.moving.angular,
                variance_per_metre=0.0,
                variance_per_radian=0.0,
            )
        )
        self._move(step.velocity or standstill)
        return step

    def _move(self, wanted: Velocity) -> None:
        limits, dt = HUSKY.limits, STEP_NS / 1e9
        dv, dw = limits.linear_acceleration * dt, limits.angular_acceleration * dt
        v = self.moving.linear + np.clip(wanted.linear - self.moving.linear, -dv, dv)
        w = self.moving.angular + np.clip(wanted.angular - self.moving.angular, -dw, dw)
        self.moving = Velocity(float(v), float(w))
        turned = Pose2(0.0, 0.0, self.moving.angular * dt / 2)
        self.pose = self.pose @ turned @ Pose2(self.moving.linear * dt, 0.0, 0.0) @ turned
        self.poses.append(self.pose)
        self.commands.append(wanted)

    def run(self, seconds: float):
        for _ in range(int(seconds * 1e9 / STEP_NS)):
            step = self.tick()
            if step.status is not None and step.status.state is not TaskState.ACTIVE:
                return step.status
        return None

    def collided(self) -> bool:
        x, y = np.meshgrid(np.linspace(-0.495, 0.495, 9), np.linspace(-0.335, 0.335, 7))
        footprint = np.stack([x.ravel(), y.ravel()], axis=-1)
        points = np.concatenate([pose.apply(footprint) for pose in self.poses])
        columns, rows = ((points - ORIGIN) / RESOLUTION).astype(int).T
        return bool(self.truth[rows, columns].any())


def open_ground() -> np.ndarray:
    return np.zeros((200, 200), bool)


def wall_with_gap() -> np.ndarray:
    ground = open_ground()
    ground[:90, 100:103] = True
    ground[120:, 100:103] = True
    return ground


@pytest.mark.parametrize(
    "goal", [(8.0, 0.0, 0.0), (6.0, 5.0, -2.0), (-3.0, 1.0, 3.0), (0.0, 0.0, 2.5)]
)
def test_reaches_the_goal_and_faces_it(goal):
    rig = Rig(open_ground(), open_ground())
    rig.navigator.take_goal(goal_at(*goal))
    status = rig.run(40)
    assert status is not None
    assert status.state is TaskState.SUCCEEDED
    assert np.hypot(rig.pose.x - goal[0], rig.pose.y - goal[1]) < 0.4
    for _ in range(10):
        rig.tick()
    assert abs(wrap_angle(rig.pose.yaw - goal[2])) < 0.2


def test_drives_through_a_gap_without_touching_anything():
    rig = Rig(wall_with_gap(), wall_with_gap())
    rig.navigator.take_goal(goal_at(9.0, 0.0))
    status = rig.run(60)
    assert status is not None
    assert status.state is TaskState.SUCCEEDED
    assert not rig.collided()


def test_commands_stay_within_the_limits():
    rig = Rig(wall_with_gap(), wall_with_gap())
    rig.navigator.take_goal(goal_at(9.0, 0.0))
    rig.run(60)
    assert max(abs(c.linear) for c in rig.commands) <= 0.8 + 1e-9
    assert max(abs(c.angular) for c in rig.commands) <= HUSKY.limits.angular_speed


def test_stops_before_an_obstacle_that_only_the_scan_shows():
    rig = Rig(open_ground(), open_ground())
    rig.navigator.take_goal(goal_at(9.0, 0.0))
    rig.run(3)
    x = int((rig.pose.x + 1.6 - ORIGIN[0]) / RESOLUTION)
    rig.truth[30:70, x : x + 3] = True
    rig.run(3)
    assert not rig.collided()
    assert abs(rig.moving.linear) < 0.1


def test_a_goal_that_stays_blocked_fails():
    rig = Rig(open_ground(), open_ground())
    rig.truth[:, 80:83] = True
    rig.navigator.take_goal(goal_at(9.0, 0.0))
    status = rig.run(60)
    assert status is not None
    assert status.state is TaskState.FAILED
    assert status.reason == "blocked"
    assert not rig.collided()


def test_a_goal_without_a_path_fails_and_says_so():
    ground = open_ground()
    ground[30:70, 100:140] = True  # A ring of walls around the goal.
    ground[33:67, 103:137] = False
    rig = Rig(ground, ground)
    rig.navigator.take_goal(goal_at(7.0, 0.0))
    status = rig.run(10)
    assert status is not None
    assert status.state is TaskState.FAILED
    assert status.reason.startswith("no path")


def test_stop_holds_still_and_release_goes_on():
    rig = Rig(open_ground(), open_ground())
    rig.navigator.take_goal(goal_at(6.0, 0.0))
    rig.run(2)
    rig.navigator.take_stop(True)
    count = len(rig.commands)
    rig.run(3)
    assert all(c == standstill for c in rig.commands[count:])
    rig.navigator.take_stop(False)
    status = rig.run(20)
    assert status is not None
    assert status.state is TaskState.SUCCEEDED


def test_nothing_moves_without_a_fresh_scan():
    rig = Rig(open_ground(), open_ground(), scans=False)
    rig.navigator.take_goal(goal_at(6.0, 0.0))
    rig.run(2)
    assert all(c == standstill for c in rig.commands)
    rig.scans = True
    rig.run(2)
    assert rig.pose.x > 0.5
    rig.scans = False
    rig.run(2)
    assert rig.commands[-1] == standstill


def test_a_finished_goal_is_not_started_again():
    rig = Rig(open_ground(), open_ground())
    rig.navigator.take_finished("g")
    rig.navigator.take_goal(goal_at(6.0, 0.0))
    rig.run(2)
    assert rig.pose == Pose2(0.0, 0.0, 0.0)


def test_an_obstacle_at_the_bumper_forbids_forward_and_allows_back():
    ahead = np.array([[0.55, 0.0]])
    base, limits = HUSKY.base, HUSKY.limits
    assert allowed(Velocity(0.5, 0.0), ahead, base, limits) == standstill
    assert allowed(Velocity(-0.3, 0.0), ahead, base, limits) == Velocity(-0.3, 0.0)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_long_base_in_a_doorway_leaves_it_the_shorter_way_to_turn(way: float):
    base, limits = WHEELCHAIR.base, WHEELCHAIR.limits
    jambs = np.array([(-way * x, y) for x in (0.2, 0.3, 0.4) for y in (-0.4, 0.4)])
    assert allowed(Velocity(0.0, 0.7), jambs, base, limits) == standstill
    velocity = towards_room(jambs, base, limits)
    assert velocity.linear * way > 0
    assert velocity.angular == 0


def test_a_base_walled_in_stays_where_it_is():
    base, limits = WHEELCHAIR.base, WHEELCHAIR.limits
    walls = np.array([(x, y) for x in (-0.62, 0.62) for y in np.arange(-0.4, 0.5, 0.1)])
    assert towards_room(walls, base, limits) == standstill


def test_a_long_base_wedged_in_a_doorway_turns_back_before_it_turns_on():
    base, limits = WHEELCHAIR.base, WHEELCHAIR.limits
    jambs = np.array([(0.45, 0.4), (-0.45, -0.4)])
    assert allowed(Velocity(0.0, 0.7), jambs, base, limits) == standstill
    assert turning(Velocity(0.0, 0.7), jambs, base, limits).angular < 0


def test_small_steps_never_add_up_to_a_touch():
    base, limits = WHEELCHAIR.base, WHEELCHAIR.limits
    gap, wanted = 0.06, Velocity(0.3, 0.0)
    for _ in range(200):
        obstacle = np.array([[0.5 * base.length + gap, 0.0]])
        gap -= 0.05 * allowed(wanted, obstacle, base, limits).linear
    assert gap > 0.02
