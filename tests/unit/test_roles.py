"""Who may do what: laws that hold however the tables change."""

import pytest

from schemas import topics
from schemas.errors import UserError
from schemas.run import RunConfig
from services.process_table import PROCESSES, process_named
from services.roles import ROLES, Role, role_named, services_of

moves = {topics.BASE_COMMAND, topics.ARM_COMMAND, topics.GRIPPER_COMMAND}
asks_for_motion = {topics.INSTRUCTION, topics.ANSWER, topics.STOP, topics.CANCEL}


def test_every_service_has_one_role() -> None:
    placed = [name for role in ROLES for name in role.services]
    assert sorted(placed) == sorted(process.name for process in PROCESSES)


@pytest.mark.parametrize("role", ROLES, ids=lambda role: role.name)
def test_only_the_robot_commands_motion_and_only_the_operator_asks_for_it(role: Role) -> None:
    says = set(role.publishes)
    assert bool(says & moves) == (role.name == "robot")
    assert (says & asks_for_motion == asks_for_motion) == (role.name == "operator")
    assert role.name == "operator" or not says & asks_for_motion


def test_the_viewer_says_nothing_and_sees_what_the_operator_sees() -> None:
    assert role_named("viewer").publishes == ()
    shown = set(process_named("web").listens) - {topics.TICK}
    assert set(role_named("viewer").listens) == shown


def test_a_role_may_do_what_its_services_do() -> None:
    for role in ROLES:
        for process in PROCESSES:
            if process.name in role.services:
                assert set(process.publishes) <= set(role.publishes)
                assert set(process.listens) - {topics.TICK} <= set(role.listens)


def test_services_that_a_run_does_not_need_are_left_out() -> None:
    outdoors = [process.name for process in services_of("compute", RunConfig(robot="husky"))]
    assert "scenes" not in outdoors
    assert "mapping" in outdoors


def test_only_a_robot_with_an_arm_runs_what_moves_it() -> None:
    for robot, has_arm in (("husky", False), ("husky_ur5", True)):
        names = [process.name for process in services_of("robot", RunConfig(robot=robot))]
        assert ("manipulation" in names) == has_arm
        assert "navigation" in names


def test_an_unknown_role_lists_those_there_are() -> None:
    with pytest.raises(UserError, match=r"driver.*compute.*viewer"):
        role_named("driver")
