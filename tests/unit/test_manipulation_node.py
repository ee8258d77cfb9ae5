"""The arm's process with an arm of thin air: what it remembers, sends and says."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from robots.husky_ur5.spec import UR5
from schemas import topics
from schemas.geometry import Pose2, Pose3
from schemas.motion import ArmCommand, StopLatch
from schemas.run import RunConfig
from schemas.sensing import JointState, Odometry
from schemas.task import Handling, HandlingFailure, HandlingGoal, HandlingStatus, TaskState
from services.manipulation.errors import RefusalError
from services.manipulation.hand import PLANNING_S
from services.manipulation.node import ManipulationNode
from services.manipulation.obstacles import box, own_body
from services.manipulation.placing import ABOVE, plan_place
from services.manipulation.straight import tool_frame
from services.manipulation.surroundings import Body, Solid, Surroundings
from services.manipulation.workspace import Workspace, grasp_felt
from tests.unit.test_manipulation_picking import HUSKY_UR5, STOW

RUN = RunConfig(robot="husky_ur5")
TICK_NS = 50_000_000
HERE = Pose2(0.0, 0.0, 0.0)
NAMES = ("left_front_wheel", *UR5.joints, *UR5.fingers)


def body(label: str, x: float, y: float, side: float = 0.1, variance: float = 1e-4) -> Body:
    frame = np.eye(4)
    frame[:3, 3] = (x, y, side / 2)
    solid = Solid("box", np.eye(4), np.full(3, side))
    return Body(label, frame, np.full(3, side), variance, 0, (solid,))


class Puppet:
    """A node, and joints that are where it commands them to be."""

    def __init__(self, node: ManipulationNode | None = None) -> None:
        self.node = node or ManipulationNode(RUN, np.random.default_rng(0))
        self.handlers = self.node.handlers()
        self.stamp_ns = 0
        self.joints, self.gap = STOW.copy(), 0.0
        self.commands: list[ArmCommand] = []
        self.statuses: list[HandlingStatus] = []
        self._began: dict[str, int] = {}

    def tell(self, topic, message) -> None:
        for output in self.handlers[topic](message):
            if output.topic is topics.HANDLING_STATUS:
                self.statuses.append(output.message)
            elif output.topic is topics.ARM_COMMAND:
                self._obey(output.message)
            elif output.topic is topics.GRIPPER_COMMAND:
                self.gap = output.message.opening

    def _obey(self, command: ArmCommand) -> None:
        began = self._began.setdefault(command.id, self.stamp_ns)
        self.commands.append(command)
        time = (self.stamp_ns - began) / 1e9 + 0.05
        for joint in range(6):
            self.joints[joint] = np.interp(time, command.times, command.positions[:, joint])

    def ask(self, action: Handling, name: str = "one") -> None:
        goal = HandlingGoal(
            stamp_ns=self.stamp_ns, id=name, instruction_id="i", action=action, label="ball",
            map_from_thing=Pose3((0.8, 0.0, 0.05), (1.0, 0.0, 0.0, 0.0)), size=(0.1, 0.1, 0.1),
        )  # fmt: skip
        self.tell(topics.HANDLING_GOAL, goal)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e9 / TICK_NS)):
            self.stamp_ns += TICK_NS
            positions = np.r_[7.0, self.joints, self.gap / 2, self.gap / 2]
            state = JointState(
                stamp_ns=self.stamp_ns, names=NAMES, positions=positions, velocities=0 * positions
            )
            self.tell(topics.JOINT_STATE, state)

    def stop(self, stopped: bool) -> None:
        latch = StopLatch(stamp_ns=self.stamp_ns, stopped=stopped, source="test")
        self.tell(topics.STOP, latch)


@pytest.fixture
def unfolded() -> Puppet:
    puppet = Puppet()
    puppet.joints = np.array(UR5.poses["look"])
    puppet.run(1.0)
    return puppet


def test_the_arm_folds_and_nothing_is_sent_before_the_plan_can_be_there(unfolded: Puppet) -> None:
    asked_ns = unfolded.stamp_ns
    unfolded.ask(Handling.STOW)
    unfolded.run(5.0)
    assert unfolded.statuses[-1].state is TaskState.SUCCEEDED
    assert unfolded.commands[0].stamp_ns - asked_ns >= PLANNING_S * 1e9
    np.testing.assert_allclose(unfolded.joints, STOW, atol=0.02)
    assert {one.goal_id for one in unfolded.statuses} == {"one"}


def test_nothing_is_sent_when_all_is_done(unfolded: Puppet) -> None:
    unfolded.ask(Handling.STOW)
    unfolded.run(5.0)
    sent = len(unfolded.commands)
    unfolded.run(2.0)
    unfolded.ask(Handling.STOW)
    unfolded.run(2.0)
    assert len(unfolded.commands) == sent


def test_a_stop_ends_the_goal_and_a_new_motion_has_a_new_id(unfolded: Puppet) -> None:
    unfolded.ask(Handling.STOW)
    unfolded.run(1.2)
    sent = len(unfolded.commands)
    assert sent
    unfolded.stop(True)
    unfolded.run(1.0)
    assert len(unfolded.commands) == sent
    assert unfolded.statuses[-1].state is TaskState.CANCELLED
    unfolded.stop(False)
    unfolded.ask(Handling.STOW, "two")
    unfolded.run(5.0)
    assert unfolded.statuses[-1].state is TaskState.SUCCEEDED
    assert unfolded.commands[-1].id != unfolded.commands[0].id


def test_a_newer_goal_replaces_the_older_one(unfolded: Puppet) -> None:
    unfolded.ask(Handling.STOW, "one")
    unfolded.run(1.2)
    unfolded.ask(Handling.STOW, "two")
    cancelled = unfolded.statuses[-1]
    assert (cancelled.goal_id, cancelled.state) == ("one", TaskState.CANCELLED)
    unfolded.run(5.0)
    done = unfolded.statuses[-1]
    assert (done.goal_id, done.state) == ("two", TaskState.SUCCEEDED)


def test_a_restarted_process_repeats_nothing_and_knows_what_it_holds() -> None:
    puppet = Puppet()
    ended = HandlingStatus(
        stamp_ns=0,
        goal_id="one",
        state=TaskState.SUCCEEDED,
        failure=None,
        reason="",
        holding="ball",
    )
    list(puppet.node.resume()[topics.HANDLING_STATUS](ended))
    puppet.gap = 0.09
    puppet.ask(Handling.PICK, "one")
    puppet.run(1.0)
    assert puppet.statuses == []
    puppet.ask(Handling.PICK, "two")
    puppet.run(1.0)
    assert puppet.statuses[-1].holding == "ball"
    assert puppet.statuses[-1].reason == "the ball is in the gripper already"
    puppet.gap = 0.0
    puppet.run(0.2)
    assert puppet.statuses[-1].failure is HandlingFailure.DROPPED


def test_the_motions_of_a_restarted_process_are_new_to_the_driver(unfolded: Puppet) -> None:
    unfolded.ask(Handling.STOW)
    unfolded.run(1.2)
    sent = {command.id for command in unfolded.commands}
    unfolded.node = ManipulationNode(RUN, np.random.default_rng(0))
    unfolded.handlers = unfolded.node.handlers()
    unfolded.ask(Handling.STOW)
    unfolded.run(5.0)
    assert unfolded.commands[-1].id not in sent
    np.testing.assert_allclose(unfolded.joints, STOW, atol=0.02)


def test_a_goal_that_cannot_be_met_moves_nothing() -> None:
    puppet = Puppet()
    puppet.run(1.0)
    puppet.ask(Handling.PLACE)
    puppet.run(2.0)
    assert puppet.statuses[-1].failure is HandlingFailure.NOT_HELD
    assert puppet.commands == []


def test_the_base_that_moves_ends_the_work(unfolded: Puppet) -> None:
    unfolded.ask(Handling.STOW)
    unfolded.run(1.2)
    moved = Odometry(
        stamp_ns=unfolded.stamp_ns, odom_from_base=Pose2(0.2, 0.0, 0.0), linear=0.0, angular=0.0,
        variance_per_metre=0.0, variance_per_radian=0.0,
    )  # fmt: skip
    unfolded.tell(topics.ODOMETRY, moved)
    unfolded.run(0.2)
    assert unfolded.statuses[-1].failure is HandlingFailure.LOST


# What stands around


def seen(*pictures: Sequence[Body]) -> list[Body]:
    around = Surroundings()
    for picture in pictures:
        around.see(picture)
    return around.bodies


def test_pictures_of_one_thing_make_one_thing_and_its_place_better() -> None:
    rng = np.random.default_rng(0)
    pictures = [
        [body("ball", *(0.8 + 0.02 * rng.normal(size=2)), variance=8e-4)] for _ in range(20)
    ]
    (only,) = seen(*pictures)
    assert np.abs(only.middle[:2] - 0.8).max() < 0.015
    assert only.variance < 8e-4


def test_two_things_stay_two() -> None:
    assert len(seen([body("ball", 0.8, 0.0), body("ball", 0.8, 0.4)])) == 2
    assert len(seen([body("box", 0.8, 0.0, 0.4)], [body("ball", 0.8, 0.02)])) == 2


def test_one_picture_does_not_make_a_box_a_suitcase() -> None:
    box_here, suitcase = body("box", 0.8, 0.0, 0.4), body("suitcase", 0.81, 0.0, 0.4)
    assert [b.label for b in seen([box_here], [box_here], [suitcase])] == ["box"]
    assert [b.label for b in seen([suitcase], [box_here], [box_here])] == ["box"]


def test_a_look_from_afar_does_not_spoil_what_was_seen_from_near() -> None:
    near, far = body("ball", 0.8, 0.0, variance=1e-5), body("ball", 0.9, 0.0, variance=1e-2)
    (only,) = seen([near], [far])
    assert only.middle[0] == 0.8


def test_a_box_holds_what_is_in_it_but_not_itself_nor_what_stands_beside() -> None:
    crate = body("box", 0.8, 0.0, 0.4)
    assert crate.holds(body("ball", 0.85, 0.1))
    assert not crate.holds(body("ball", 0.8, 0.3))
    assert not crate.holds(body("suitcase", 0.81, 0.0, 0.4))


def test_what_is_in_the_hand_is_no_obstacle() -> None:
    work = Workspace(HUSKY_UR5, np.random.default_rng(0), joints=np.array(UR5.poses["carry"]))
    x, y, _ = tool_frame(UR5, work.joints)[:3, 3].tolist()
    held = body("ball", x, y)
    held = replace(held, odom_from_box=tool_frame(UR5, work.joints))
    work.see([held])
    assert len(work.surroundings.bodies) == 1
    work.surroundings.forget(work.surroundings.bodies[0])
    work.grasp = grasp_felt(UR5, "ball", 0.1)
    work.see([held, body("ball", 0.8, 1.0)])
    (other,) = work.surroundings.bodies
    assert other.middle[1] == 1.0


# Putting down


def place(x: float, y: float, *more) -> object:
    held = grasp_felt(UR5, "ball", 0.09)
    carry = np.array(UR5.poses["carry"])
    around = [*own_body(HUSKY_UR5), *more]
    rng = np.random.default_rng(0)
    return plan_place(UR5, held.held, 0.09, np.array([x, y, 0.045]), around, carry, rng)


def test_what_is_put_down_comes_to_stand_where_it_is_wanted() -> None:
    planned = place(0.75, -0.45)
    end = tool_frame(UR5, planned.lower.positions[-1])[:3, 3]
    np.testing.assert_allclose(end, [0.75, -0.45, 0.045 + ABOVE], atol=1e-6)
    np.testing.assert_allclose(planned.lower.positions[-1], planned.leave.positions[0])
    np.testing.assert_allclose(planned.approach.positions[-1], planned.lower.positions[0])


@pytest.mark.parametrize(
    ("x", "more", "failure"),
    [
        (2.0, (), HandlingFailure.UNREACHABLE),
        (0.75, (box("crate", (0.75, -0.45, 0.1), (0.3, 0.3, 0.2)),), "in_collision"),
    ],
)
def test_a_place_that_will_not_do_is_refused(x: float, more: tuple, failure: str) -> None:
    with pytest.raises(RefusalError) as refused:
        place(x, -0.45, *more)
    assert failure in refused.value.failure
    assert refused.value.reason
