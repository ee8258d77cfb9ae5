import numpy as np

from robots.husky.spec import HUSKY
from schemas import topics
from schemas.belief import MapBelief, OccupancyGrid
from schemas.codec import decode, encode
from schemas.geometry import Pose2
from schemas.motion import BaseCommand, StopLatch
from schemas.run import RunConfig
from schemas.sensing import LaserScan, Odometry
from schemas.task import Goal, GoalStatus, TaskState
from services.navigation.node import NavigationNode, valid_ms

TICK = 50_000_000
HERE = Pose2(0.0, 0.0, 0.0)


def goal(name: str, x: float, tolerance: float = 0.2) -> Goal:
    return Goal(
        stamp_ns=0,
        id=name,
        instruction_id="i",
        map_from_goal=Pose2(x, 0.0, 0.0),
        tolerance=tolerance,
        face=False,
        speed_limit=0.8,
    )


def odometry(stamp_ns: int, pose: Pose2 = HERE) -> Odometry:
    return Odometry(
        stamp_ns=stamp_ns,
        odom_from_base=pose,
        linear=0.0,
        angular=0.0,
        variance_per_metre=0.0,
        variance_per_radian=0.0,
    )


def scan(stamp_ns: int) -> LaserScan:
    return LaserScan(
        stamp_ns=stamp_ns,
        angle_min=0.0,
        angle_increment=np.pi / 180,
        range_max=20.0,
        ranges=np.full(360, np.inf, np.float32),
        base_from_laser=HUSKY.laser.base_from_laser,
        odom_from_base=HERE,
    )


def belief_at(map_from_odom: Pose2) -> MapBelief:
    """Of an empty world."""
    none, nobody = np.zeros(0), np.zeros(0, np.int32)
    return MapBelief(
        stamp_ns=1,
        instruction_id="",
        classes=(),
        weights=np.ones(1),
        particle=nobody,
        node=nobody,
        class_index=nobody,
        class_probability=none,
        position=np.zeros((0, 2)),
        covariance=np.zeros((0, 2, 2)),
        extent=np.zeros((0, 3)),
        existence=none,
        figure=np.full(1, -1, np.int32),
        landmark=np.full(1, -1, np.int32),
        figure_class=np.full(1, -1, np.int32),
        landmark_class=np.full(1, -1, np.int32),
        topology=np.zeros(1, np.int32),
        node_regions=np.zeros((0, 0), np.int32),
        region_edges=np.zeros((0, 3), np.int32),
        viewer=HERE,
        map_from_odom=map_from_odom,
        map_from_base=HERE,
        trajectory=np.zeros((0, 3)),
        effective_particles=1.0,
    )


def ready() -> NavigationNode:
    node = NavigationNode(RunConfig(), np.random.default_rng(0))
    node.on_grid(
        OccupancyGrid(
            stamp_ns=1,
            origin=(-10.0, -10.0),
            resolution=0.2,
            occupancy=np.full((100, 100), -20, np.int8),
            looked=np.zeros((100, 100), np.int8),
        )
    )
    node.on_belief(belief_at(HERE))
    node.on_scan(scan(TICK))
    return node


def tick(node: NavigationNode, stamp_ns: int, pose: Pose2 = HERE):
    outputs = list(node.on_odometry(odometry(stamp_ns, pose)))
    for output in outputs:  # Whatever is said must survive the wire.
        decode(encode(output.message), output.topic.type)
    commands = [o.message for o in outputs if isinstance(o.message, BaseCommand)]
    return commands, [o.message for o in outputs if isinstance(o.message, GoalStatus)]


def test_every_handler_is_for_a_message_of_its_topic():
    node = ready()
    assert set(node.handlers()) >= {topics.GOAL, topics.ODOMETRY, topics.SCAN, topics.STOP}
    assert set(node.resume()) == {topics.GOAL_STATUS}


def test_without_a_goal_nothing_is_said():
    assert tick(ready(), TICK) == ([], [])


def test_a_goal_is_driven_to_with_short_lived_commands_and_reported_twice_a_second():
    node = ready()
    node.on_goal(goal("g", 5.0))
    reports = []
    for count in range(1, 41):
        node.on_scan(scan(count * TICK))
        (command,), said = tick(node, count * TICK)
        assert command.valid_ms == valid_ms
        assert command.linear > 0
        reports += said
    assert len(reports) == 4
    assert all(status.state is TaskState.ACTIVE and len(status.path) > 1 for status in reports)


def test_arrival_is_told_once_with_a_command_to_stand():
    node = ready()
    node.on_goal(goal("g", 5.0))
    (command,), (status,) = tick(node, TICK, Pose2(4.9, 0.0, 0.0))
    assert (command.linear, command.angular) == (0.0, 0.0)
    assert status.state is TaskState.SUCCEEDED
    node.on_goal(goal("g", 5.0))
    assert tick(node, 2 * TICK) == ([], [])


def test_a_halt_goal_ends_another_goal_where_the_robot_stands():
    node = ready()
    node.on_goal(goal("g", 5.0))
    tick(node, TICK)
    node.on_goal(goal("halt", 0.0, tolerance=100.0))
    (command,), (status,) = tick(node, 2 * TICK, Pose2(1.0, 0.0, 0.0))
    assert (command.linear, command.angular) == (0.0, 0.0)
    assert (status.goal_id, status.state) == ("halt", TaskState.SUCCEEDED)


def test_stop_is_obeyed_at_once():
    node = ready()
    node.on_goal(goal("g", 5.0))
    (output,) = node.on_stop(StopLatch(stamp_ns=TICK, stopped=True, source="web"))
    assert output.topic is topics.BASE_COMMAND
    (command,), _ = tick(node, TICK)
    assert (command.linear, command.angular) == (0.0, 0.0)


def test_a_goal_that_ended_before_a_restart_stays_ended():
    node = ready()
    done = GoalStatus(
        stamp_ns=1, goal_id="g", state=TaskState.SUCCEEDED, reason="", path=np.zeros((0, 2))
    )
    node.resume()[topics.GOAL_STATUS](done)
    node.on_goal(goal("g", 5.0))
    assert tick(node, TICK) == ([], [])
