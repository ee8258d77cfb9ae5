"""Grasps and looks: what fits the gripper, what can be reached, and what is refused."""

import math

import numpy as np
import pytest

from robots.arm_kinematics import forward, inverse_of, matrix
from robots.husky_ur5.spec import HUSKY_UR5, UR5
from schemas.task import HandlingFailure
from services.manipulation.collision import ArmCollision
from services.manipulation.errors import RefusalError
from services.manipulation.grasps import Thing, candidates
from services.manipulation.looks import SWEEP, look_into, panned
from services.manipulation.obstacles import box, own_body
from services.manipulation.picking import plan_pick
from services.manipulation.straight import tool_frame

STOW = np.array(UR5.poses["stow"])
WIDE = UR5.gripper.opening
BOX_SIZE = np.array([0.36, 0.34, 0.22])


def frame(x: float, y: float, z: float, yaw: float = 0.0) -> np.ndarray:
    made = np.eye(4)
    made[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
    made[:3, 3] = (x, y, z)
    return made


def ball(x: float, y: float, z: float, diameter: float = 0.1) -> Thing:
    return Thing("ball", frame(x, y, z), np.full(3, diameter))


def open_box(x: float, y: float) -> list:
    length, width, height = BOX_SIZE.tolist()
    middle = height / 2
    ends = [box("box", (x + s * length / 2, y, middle), (0.012, width, height)) for s in (-1, 1)]
    sides = [box("box", (x, y + s * width / 2, middle), (length, 0.012, height)) for s in (-1, 1)]
    return [*ends, *sides, box("box", (x, y, 0.006), (length, width, 0.012))]


def around(*more) -> list:
    return [*own_body(HUSKY_UR5), *more]


def pick(thing: Thing, obstacles: list, **options):
    return plan_pick(UR5, thing, obstacles, STOW, np.random.default_rng(0), **options)


def test_fingers_close_across_the_narrow_side_first() -> None:
    yaw = 0.4
    brick = Thing("box", frame(0.8, 0, 0.1, yaw), np.array([0.30, 0.06, 0.2]))
    grasps = candidates(UR5.gripper, brick)
    closing = grasps.base_from_tool[0, :3, 1]
    narrow = np.array([-math.sin(yaw), math.cos(yaw), 0.0])
    assert abs(closing @ narrow) > 0.95
    assert (grasps.openings <= WIDE).all()
    assert grasps.widths[0] == grasps.widths[np.argmin(grasps.widths)]


def test_what_is_too_big_is_refused_with_both_measures() -> None:
    with pytest.raises(RefusalError, match=r"0\.200 m wide.*up to 0\.146 m") as refused:
        candidates(UR5.gripper, ball(0.8, 0, 0.1, 0.2))
    assert refused.value.failure is HandlingFailure.TOO_BIG


def test_fingers_keep_off_surfaces_that_were_seen() -> None:
    thing = ball(0.8, 0.0, 0.05)
    y, z = np.meshgrid(np.linspace(-0.1, 0.1, 41), np.linspace(0.0, 0.2, 41))
    wall = np.stack([np.full(y.size, 0.8 - 0.06), y.ravel(), z.ravel()], axis=1)
    grasps = candidates(UR5.gripper, thing, wall)
    everywhere = candidates(UR5.gripper, thing)
    assert 0 < len(grasps) < len(everywhere)
    # Closing against the wall is gone, closing along it is kept.
    down = grasps.base_from_tool[grasps.base_from_tool[:, 2, 2] < -0.999]
    assert np.abs(down[:, 0, 1]).max() < 0.9


def test_a_ball_in_a_box_is_taken_without_touching_the_box() -> None:
    obstacles = around(*open_box(0.88, 0.0))
    thing = ball(0.92, 0.04, 0.062)
    planned = pick(thing, obstacles)
    hand = ArmCollision(UR5, obstacles, planned.opening, clearance=0.0)
    for motion in (planned.approach, planned.descend, planned.lift):
        assert hand.free_along(motion.positions)
    np.testing.assert_allclose(planned.approach.positions[-1], planned.descend.positions[0])
    np.testing.assert_allclose(planned.descend.positions[-1], planned.lift.positions[0])
    reached = tool_frame(UR5, planned.descend.positions[-1])[:3, 3]
    np.testing.assert_allclose(reached, thing.base_from_box[:3, 3], atol=1e-6)
    lifted = tool_frame(UR5, planned.lift.positions[-1])[2, 3]
    assert lifted > reached[2] + 0.15


def test_another_candidate_is_another_grasp() -> None:
    thing, obstacles = ball(0.88, 0.0, 0.062), around(*open_box(0.88, 0.0))
    first, second = (pick(thing, obstacles, skip=skip) for skip in (0, 6))
    apart = np.abs(first.descend.positions[-1] - second.descend.positions[-1]).max()
    assert apart > 0.1


def test_what_is_out_of_reach_is_refused_with_the_distance() -> None:
    with pytest.raises(RefusalError, match=r"m from the arm's foot") as refused:
        pick(ball(2.5, 0.0, 0.05), around())
    assert refused.value.failure is HandlingFailure.UNREACHABLE


def test_what_is_walled_in_is_refused() -> None:
    walls = [
        box("wall", (0.85 + dx, dy, 0.2), (0.13 if dy else 0.02, 0.02 if dy else 0.13, 0.4))
        for dx, dy in ((0.058, 0.0), (-0.058, 0.0), (0.0, 0.058), (0.0, -0.058))
    ]
    with pytest.raises(RefusalError, match=r"wall") as refused:
        pick(ball(0.85, 0.0, 0.05), around(*walls))
    assert refused.value.failure is HandlingFailure.GOAL_IN_COLLISION


def test_the_wrist_camera_sees_into_the_box_that_it_looks_into() -> None:
    place, obstacles = frame(0.9, 0.1, BOX_SIZE[2] / 2, 0.0), around(*open_box(0.9, 0.1))
    look = look_into(HUSKY_UR5, place, BOX_SIZE, obstacles, STOW, WIDE)
    assert look.seen >= 0.9
    assert ArmCollision(UR5, obstacles, WIDE).free(look.joints)
    camera = UR5.camera
    base_from_camera = (
        matrix(UR5.base_from_foot) @ forward(UR5, look.joints) @ matrix(camera.flange_from_camera)
    )
    middle = inverse_of(base_from_camera) @ np.array([0.9, 0.1, 0.0, 1.0])
    assert middle[2] > 0.3
    assert np.abs(middle[:2] / middle[2]).max() < 0.05


def test_a_box_out_of_reach_cannot_be_looked_into() -> None:
    with pytest.raises(RefusalError, match=r"3\.00 m away"):
        look_into(HUSKY_UR5, frame(3.0, 0, 0.11), BOX_SIZE, around(), STOW, WIDE)


def test_an_empty_box_is_left_backwards_and_looked_for_on_both_sides() -> None:
    assert SWEEP[0].back_up == SWEEP[0].pan == 0
    assert sorted(round(math.degrees(glance.pan)) for glance in SWEEP[1:]) == [-30, 0, 30]
    look = np.array(UR5.poses["look"])
    turned = forward(UR5, panned(UR5, look, math.pi / 6))
    c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)
    spin = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    np.testing.assert_allclose(turned[:3, 3], spin @ forward(UR5, look)[:3, 3], atol=1e-9)
