"""Bad input: mapping says in words what was wrong, keeps a distribution, and goes on."""

import math

import gtsam
import msgspec
import numpy as np
import pytest

from robots.catalogue import get_robot
from schemas import codec, topics
from schemas.belief import MapBelief
from schemas.faults import FaultLog, period_ns
from schemas.geometry import Pose2
from schemas.health import Fault
from schemas.language import Annotation, Relation
from schemas.perception import Detections
from schemas.sensing import LaserScan
from schemas.topics import Output
from services.mapping import cases, graph
from services.mapping.backbone import Backbone
from services.mapping.filter import SemanticFilter
from services.mapping.grid import Grid
from services.mapping.odometer import OdometryNoise
from services.mapping.timeline import Timeline
from services.mapping.wheels import Reading, Step, Wheels
from tests.unit.test_mapping_episode import (
    BEHIND,
    FRAME_NS,
    World,
    last_belief,
    make_node,
    says,
)
from tests.unit.test_mapping_grid import scan

HUSKY = get_robot("husky")
STRAIGHT = (6.0, 0.0)


class Robot:
    """A node behind its handlers, as both executors run it, in a world that feeds it."""

    def __init__(self, *things: tuple[str, float, float], seed: int = 0) -> None:
        self.world = World(list(things), false_rate=0.0)
        self.node = make_node(seed)
        self.handlers = self.node.handlers()
        self.said: list[Output] = []

    def hear(self, message: object) -> list[Output]:
        said = list(self.handlers[topics.ANNOTATIONS](message))
        self.said += said
        return said

    def put(self, *messages: object) -> list[Output]:
        kinds = {Detections: topics.DETECTIONS, LaserScan: topics.SCAN}
        said = [
            output
            for message in messages
            for output in self.handlers[kinds.get(type(message), topics.ODOMETRY)](message)
        ]
        self.said += said
        return said

    def drive(self, frames: int, goal: tuple[float, float] = STRAIGHT) -> None:
        for _ in range(frames):
            self.said += self.world.step(goal, _Handled(self))  # type: ignore[arg-type]

    @property
    def faults(self) -> list[Fault]:
        return [output.message for output in self.said if isinstance(output.message, Fault)]

    @property
    def belief(self) -> MapBelief:
        return last_belief(self.said)


class _Handled:
    """What `World.step` calls, led through the handlers."""

    def __init__(self, robot: Robot) -> None:
        self.on_odometry = robot.handlers[topics.ODOMETRY]
        self.on_detections = robot.handlers[topics.DETECTIONS]


def at_work() -> Robot:
    """A robot that has heard an instruction and seen a cone and a hydrant."""
    robot = Robot(("cone", 4.0, 1.0), ("hydrant", 6.5, 1.6))
    robot.hear(BEHIND)
    robot.drive(10)
    assert not robot.faults
    return robot


def assert_sound(belief: MapBelief) -> None:
    assert belief.weights.sum() == pytest.approx(1.0)
    for column in ("weights", "position", "covariance", "existence", "trajectory"):
        assert np.isfinite(getattr(belief, column)).all(), column
    assert (np.linalg.eigvalsh(belief.covariance) > 0).all()


def assert_goes_on(robot: Robot, what: str, *words: str) -> None:
    """It was reported once, in these words; the map stands and the robot maps on."""
    told = [fault for fault in robot.faults if fault.what == what]
    assert told, [fault.what for fault in robot.faults]
    for word in words:
        assert word in told[0].detail
    robot.drive(5)
    assert_sound(robot.belief)
    shown = robot.belief.class_index[robot.belief.seen]
    assert sorted(robot.belief.classes[index] for index in shown) == ["cone", "hydrant"]
    start = Pose2(0.0, 0.0, 0.0) @ robot.world.true
    here = robot.belief.map_from_base
    assert math.hypot(here.x - start.x, here.y - start.y) < 0.3


def later(picture: Detections, **changes: object) -> Detections:
    return msgspec.structs.replace(picture, stamp_ns=picture.stamp_ns + 1, **changes)


def with_row(values: np.ndarray, row: object) -> np.ndarray:
    changed = values.copy()
    changed[0] = row
    return changed


@pytest.mark.parametrize(
    ("column", "row", "words"),
    [
        ("centers_base", np.nan, "centre"),
        ("centers_base", np.inf, "centre"),
        ("centers_base", 1e9, "centre"),
        ("extents", np.nan, "extent"),
        ("extents", -1.0, "extent"),
        ("probabilities", np.nan, "probabilities"),
        ("probabilities", -0.1, "probabilities"),
        ("probabilities", 0.9, "sum"),
        ("covariances", np.nan, "not finite"),
        ("covariances", np.zeros((3, 3)), "positive definite"),
        ("covariances", -np.eye(3), "positive definite"),
        ("covariances", np.eye(3) + np.triu(np.ones((3, 3)), 1), "symmetric"),
    ],
)
def test_one_broken_detection_is_left_out(column: str, row: object, words: str) -> None:
    robot = at_work()
    picture = robot.world.look()
    robot.put(later(picture, **{column: with_row(getattr(picture, column), row)}))
    assert_goes_on(robot, "unusable detection", words)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"classes": ()}, "no class"),
        ({"classes": ("cone", "hydrant")}, "2 classes"),
        ({"classes": ("cone", "hydrant", "barrel", "tree")}, "4 classes"),
        ({"odom_from_base": Pose2(math.nan, 0.0, 0.0)}, "not finite"),
        ({"odom_from_base": Pose2(50.0, 0.0, 0.0)}, "dead reckoning is"),
    ],
)
def test_a_broken_picture_is_no_evidence(changes: dict[str, object], words: str) -> None:
    robot = at_work()
    assert not [
        output
        for output in robot.put(later(robot.world.look(), **changes))
        if output.topic is topics.BELIEF
    ]
    assert_goes_on(robot, "unusable detections", words)


def test_a_picture_without_classes_does_not_rule_places_out() -> None:
    robot = Robot()
    robot.hear(says("hydrant"))
    robot.drive(1)
    looked = grid_of(robot).looked.copy()
    robot.put(later(robot.world.look(), classes=(), probabilities=np.zeros((0, 0))))
    np.testing.assert_array_equal(grid_of(robot).looked, looked)


def grid_of(robot: Robot) -> Grid:
    return robot.node._filter.grid


@pytest.mark.parametrize(
    "changes",
    [
        {"view_bearings": np.linspace(0.5, -0.5, 31)},
        {"view_bearings": np.full(31, np.nan)},
        {"view_near": math.nan},
    ],
)
def test_a_broken_view_rules_nothing_out(changes: dict[str, object]) -> None:
    robot = at_work()
    looked = grid_of(robot).looked.copy()
    robot.put(later(robot.world.look(), **changes))
    np.testing.assert_array_equal(grid_of(robot).looked, looked)
    assert_goes_on(robot, "flaw in detections", "no evidence")


@pytest.mark.parametrize("late_s", [0.0, 0.2, 1.0])
def test_pictures_that_come_twice_or_out_of_order_are_not_taken(late_s: float) -> None:
    robot = at_work()
    picture = robot.world.look()
    stamp = picture.stamp_ns - round(late_s * 1e9)
    assert not any(
        output.topic is topics.BELIEF
        for output in robot.put(msgspec.structs.replace(picture, stamp_ns=stamp))
    )
    assert_goes_on(robot, "late detections", "not taken")


def test_a_picture_that_is_a_second_late_is_evidence_of_where_the_robot_was() -> None:
    robot = at_work()
    old = msgspec.structs.replace(robot.world.look(), stamp_ns=robot.world.time_ns + 1)
    for _ in range(6):
        robot.world.time_ns += FRAME_NS
        robot.world.true = robot.world.true @ Pose2(0.2, 0.0, 0.0)
        robot.world.odom = robot.world.true
        robot.put(robot.world.odometry())
    before = robot.belief.position[robot.belief.seen]
    robot.put(old)
    np.testing.assert_allclose(robot.belief.position[robot.belief.seen], before, atol=0.1)
    assert_goes_on(robot, "late detections", "1.2 s old", "where the robot was then")


@pytest.mark.parametrize(
    "changes",
    [
        {"odom_from_base": Pose2(math.nan, 0.0, 0.0)},
        {"odom_from_base": Pose2(0.0, 0.0, math.inf)},
        {"variance_per_metre": math.nan},
        {"variance_per_radian": -1.0},
    ],
)
def test_broken_odometry_is_not_followed(changes: dict[str, object]) -> None:
    robot = at_work()
    stamp = robot.world.time_ns + 1
    robot.put(msgspec.structs.replace(robot.world.odometry(), stamp_ns=stamp, **changes))
    assert_goes_on(robot, "unusable odometry")


def test_odometry_out_of_order_is_not_followed() -> None:
    robot = at_work()
    stamp = robot.world.time_ns - FRAME_NS // 2
    old = msgspec.structs.replace(
        robot.world.odometry(), stamp_ns=stamp, odom_from_base=Pose2(0.3, 0.0, 0.0)
    )
    robot.put(old)
    assert_goes_on(robot, "late odometry", "0.1 s older")


def test_a_single_wild_reading_of_the_wheels_does_nothing() -> None:
    robot = at_work()
    stamp = robot.world.time_ns + FRAME_NS // 4
    wild = msgspec.structs.replace(
        robot.world.odometry(), stamp_ns=stamp, odom_from_base=Pose2(40.0, -3.0, 2.0)
    )
    nodes = len(robot.belief.trajectory)
    robot.put(wild)
    assert_goes_on(robot, "doubtful odometry", "more than the wheels can do")
    assert len(robot.belief.trajectory) <= nodes + 2


def test_a_jump_begins_anew_and_bends_nothing() -> None:
    robot = at_work()
    before = robot.belief.position[robot.belief.seen]
    path = robot.belief.trajectory
    robot.world.odom = Pose2(30.0, -20.0, 2.0)
    robot.drive(3)
    assert robot.node._filter.backbone.uncertainty.position_variance < 1.5
    assert_goes_on(robot, "odometry jumped", "more than the wheels can do")
    np.testing.assert_allclose(robot.belief.position[robot.belief.seen], before, atol=0.25)
    np.testing.assert_allclose(robot.belief.trajectory[: len(path)], path, atol=0.25)


def test_after_a_jump_the_pose_is_doubted_until_things_are_seen_again() -> None:
    backbone = Backbone(Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, 0.0), np.zeros((0, 3)))
    here, there = Pose2(1.0, 0.0, 0.0), Pose2(-8.0, 3.0, 1.0)
    backbone.move(here, OdometryNoise(1e-4, 1e-4))
    backbone.sight(0, np.array([3.0, 1.0]), 0.01 * np.eye(2), here)
    backbone.sight(1, np.array([3.0, -1.0]), 0.01 * np.eye(2), here)
    assert backbone.jump(here, there)
    assert backbone.uncertainty.position_variance > 0.5
    assert backbone.locate(there).x == pytest.approx(1.0, abs=0.02)
    # It really was carried half a metre ahead.
    backbone.sight(0, np.array([2.5, 1.0]), 0.01 * np.eye(2), there)
    backbone.sight(1, np.array([2.5, -1.0]), 0.01 * np.eye(2), there)
    assert backbone.extend(there)
    assert backbone.locate(there).x == pytest.approx(1.5, abs=0.1)
    assert backbone.uncertainty.position_variance < 0.2


def test_where_something_was_said_survives_a_jump() -> None:
    robot = Robot()
    robot.drive(5)
    robot.hear(says("hydrant", id="i1"))
    viewer = robot.belief.viewer
    robot.world.odom = Pose2(-30.0, 5.0, 1.0)
    robot.drive(5)
    other = msgspec.structs.replace(says("cone", id="i2"), viewpoint="i1")
    again = last_belief(robot.hear(other)).viewer
    assert (again.x, again.y, again.yaw) == pytest.approx((viewer.x, viewer.y, viewer.yaw), abs=0.1)


def test_dead_reckoning_may_begin_anywhere() -> None:
    robot = Robot(("cone", 4.0, 1.0), ("hydrant", 6.5, 1.6))
    robot.world.odom = Pose2(5000.0, -2000.0, 2.0)
    robot.hear(BEHIND)
    robot.drive(10)
    assert_goes_on(robot, "odometry jumped")
    assert grid_of(robot).occupancy.size < 200_000


def test_a_clock_that_is_set_back_is_followed_in_the_end() -> None:
    robot = at_work()
    robot.world.time_ns = 0
    robot.drive(9, (20.0, 0.0))
    assert {fault.what for fault in robot.faults} == {"late odometry", "late detections"}
    nodes = len(robot.belief.trajectory)
    robot.drive(12, (20.0, 0.0))
    assert len(robot.belief.trajectory) > nodes
    assert_sound(robot.belief)


@pytest.mark.parametrize(
    "changes",
    [
        {"angle_increment": 0.0},
        {"angle_increment": math.nan},
        {"range_max": math.inf},
        {"range_max": -1.0},
        {"base_from_laser": Pose2(math.nan, 0.0, 0.0)},
        {"odom_from_base": Pose2(0.0, math.nan, 0.0)},
        {"ranges": np.zeros(0, np.float32)},
    ],
)
def test_broken_scans_do_not_enter_the_grid(changes: dict[str, object]) -> None:
    robot = at_work()
    stamp, odom = robot.world.time_ns, robot.world.odom
    robot.put(msgspec.structs.replace(scan(np.full(360, 5.0), stamp, odom), **changes))
    assert not grid_of(robot).occupancy.any()
    assert_goes_on(robot, "unusable scan")


def test_beams_that_are_no_distance_are_told_and_left_out() -> None:
    robot = at_work()
    ranges = np.full(360, np.inf)
    ranges[:90], ranges[100:110] = np.nan, -1.0
    robot.put(scan(ranges, robot.world.time_ns, robot.world.odom))
    assert np.isfinite(grid_of(robot).occupancy).all()
    assert grid_of(robot).occupancy.min() < 0
    assert_goes_on(robot, "flaw in scan", "100 of 360")


def test_a_solver_that_refuses_leaves_the_map_and_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot = at_work()
    path = robot.belief.trajectory
    with monkeypatch.context() as broken:
        # Without its odometry edge the new pose floats: the system is singular.
        broken.setattr(graph, "add_motion", _floating_pose)
        robot.drive(6)
    np.testing.assert_array_equal(robot.belief.trajectory, path)
    assert_goes_on(robot, "refused by the solver", "singular")
    robot.drive(6)
    assert len(robot.belief.trajectory) > len(path)


def _floating_pose(problem: graph.Problem, motion: graph.Motion) -> None:
    problem.values.insert(graph.pose_key(motion.after), gtsam.Pose2(0.0, 0.0, 0.0))
    flat = gtsam.noiseModel.Diagonal.Precisions(np.array([1.0, 0.0, 0.0]))
    problem.factors.add(
        gtsam.PriorFactorPose2(graph.pose_key(motion.after), gtsam.Pose2(0.0, 0.0, 0.0), flat)
    )


@pytest.mark.parametrize("value", [-np.inf, np.nan])
def test_when_no_hypothesis_is_possible_all_are_drawn_anew(
    value: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = at_work()
    with monkeypatch.context() as impossible:
        impossible.setattr(
            cases, "log_target", lambda particles, evidence: np.full(len(particles), value)
        )
        robot.drive(2)
        assert_sound(robot.belief)
    assert_goes_on(robot, "no hypothesis fits", "drawn anew")


def with_relations(*relations: Relation) -> object:
    base = says("hydrant", "left", "cone", id="i7")
    annotation = Annotation(probability=0.8, objects=("cone", "hydrant"), relations=relations)
    return msgspec.structs.replace(base, annotations=(annotation,))


def test_a_contradiction_is_told_and_the_instruction_counts() -> None:
    left, right = (Relation(side, "hydrant", "cone") for side in ("left", "right"))
    robot = at_work()
    robot.hear(with_relations(left, right))
    assert robot.belief.instruction_id == "i7"
    assert_goes_on(robot, "contradiction", "'left' and 'right' of the cone")


def test_what_agrees_is_no_contradiction() -> None:
    left, near = (Relation(side, "hydrant", "cone") for side in ("left", "near"))
    robot = at_work()
    robot.hear(with_relations(left, near, Relation("right", "hydrant", "tree")))
    assert not robot.faults


def test_a_class_that_the_map_does_not_know_is_told() -> None:
    robot = at_work()
    before = robot.belief
    assert not [o for o in robot.hear(says("dragon", id="i8")) if o.topic is topics.BELIEF]
    assert robot.belief.instruction_id == before.instruction_id
    assert_goes_on(robot, "unknown class", "'dragon'", "hydrant")


@pytest.mark.parametrize("probability", [math.nan, -0.5, math.inf])
def test_readings_without_a_probability_are_not_heard(probability: float) -> None:
    robot = at_work()
    annotation = Annotation(probability=probability, objects=("cone",), relations=())
    robot.hear(msgspec.structs.replace(says("cone", id="i9"), annotations=(annotation,)))
    assert_goes_on(robot, "unusable annotations", "probabilities")


def test_one_kind_is_told_once_a_second_and_counted() -> None:
    log = FaultLog("mapping")
    told: list[Fault] = []
    for tick in range(30):
        log.note("unusable scan", f"number {tick}")
        told += log.due(tick * 100_000_000)
    assert [fault.detail for fault in told] == [
        "number 0",
        "number 1 (10 times)",
        "number 11 (10 times)",
    ]
    log.note("other", "first of its kind")
    assert [fault.what for fault in log.due(period_ns * 3)] == ["unusable scan", "other"]


def test_reports_survive_the_wire() -> None:
    robot = at_work()
    robot.put(later(robot.world.look(), classes=()))
    (fault,) = robot.faults
    assert codec.decode(codec.encode(fault), Fault) == fault
    assert fault.node == "mapping"


def test_a_straggler_is_late_and_a_clock_set_back_is_not() -> None:
    line = Timeline()
    assert [bool(line.flaw_of(stamp)) for stamp in (10, 20, 20, 15, 30)] == [
        *(False, False, True, True, False)
    ]
    assert [bool(line.flaw_of(stamp)) for stamp in range(1, 14)] == [*[True] * 9, *[False] * 4]


def test_wheels_cannot_jump_but_a_pause_explains_a_way() -> None:
    wheels = Wheels(HUSKY.limits)

    def follow(seconds: float, x: float) -> Step:
        return wheels.follow(Reading(round(seconds * 1e9), Pose2(x, 0.0, 0.0)))

    assert [follow(0.0, 0.0), follow(0.1, 0.1), follow(10.0, 9.0)] == [Step.DRIVEN] * 3
    assert [follow(10.1, 20.0), follow(10.2, 9.1)] == [Step.DOUBTFUL, Step.DRIVEN]
    assert [follow(10.3, 20.0), follow(10.4, 20.1)] == [Step.DOUBTFUL, Step.JUMPED]
    assert not wheels.agree_with(Reading(round(10.4e9), Pose2(9.1, 0.0, 0.0)))


def test_the_filter_alone_bears_broken_detections() -> None:
    world = World([("cone", 4.0, 0.0)], false_rate=0.0)
    semantic = SemanticFilter(HUSKY.symbols, HUSKY.camera, 50, np.random.default_rng(0))
    for step in range(6):
        world.time_ns += FRAME_NS
        picture = world.look()
        bad = np.full_like(picture.covariances, (np.nan, 0.0, -1.0)[step % 3])
        semantic.observe(msgspec.structs.replace(picture, covariances=bad))
    assert not semantic.objects.confirmed
    assert {fault.what for fault in semantic.faults.due(0)} == {"unusable detection"}
