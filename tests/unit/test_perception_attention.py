"""Laws of attention: what is new is looked at, what was skipped is never counted as looked at."""

import itertools
from dataclasses import dataclass, field

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.husky.spec import HUSKY
from schemas.geometry import Pose2
from schemas.sensing import Intrinsics, RgbdFrame
from services.perception.attention.attention import Attention, Plan
from services.perception.attention.regions import Shapes, shapes_in
from services.perception.detection.gaze import EVERYTHING, Gaze, cut_off
from services.perception.detection.picture import Fit
from services.perception.space.rays import camera_rays
from services.perception.space.view import GroundView, ground_view

WIDTH, HEIGHT = 160, 120
RANGE = HUSKY.camera.range_max
CAMERA = Intrinsics(WIDTH, HEIGHT, 116.0, 116.0, 79.5, 59.5)
FRAME_NS = 200_000_000
SECOND_NS = 1_000_000_000
HERE = Pose2(0.0, 0.0, 0.0)

Post = tuple[float, float, float]
"""x, y of a square post in the odometry frame [m], and its height."""


@dataclass
class Yard:
    """Posts on flat ground, and a camera over it whose readings scatter."""

    posts: list[Post] = field(default_factory=list[Post])
    pose: Pose2 = HERE
    stamp_ns: int = SECOND_NS
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    def frame(self) -> RgbdFrame:
        rays = camera_rays(CAMERA, HUSKY.camera.base_from_camera)
        down = rays.directions[..., 2]
        depth = np.where(down < 0, -rays.origin[2] / np.minimum(down, -1e-9), np.inf)
        colour = np.where(down[..., None] < 0, [120, 120, 118], [150, 180, 220]).astype(float)
        for number, (x, y, height) in enumerate(self.posts):
            at = self.pose.inverse().apply(np.array([x, y]))
            there = at[0] - 0.15 - rays.origin[0]
            points = rays.origin + rays.directions * there
            hit = (np.abs(points[..., 1] - at[1]) < 0.15) & (points[..., 2] < height)
            hit &= (points[..., 2] > 0) & (there < depth) & (there > 0)
            depth = np.where(hit, there, depth)
            colour = np.where(hit[..., None], [200, 40 + 60 * number, 30], colour)
        depth_mm = np.where(depth < 60, 1000 * depth, 0)
        noisy = depth_mm + np.where(depth_mm > 0, self.rng.normal(0, 4, depth.shape), 0)
        return RgbdFrame(
            stamp_ns=self.stamp_ns,
            color=np.clip(colour + self.rng.normal(0, 3, colour.shape), 0, 255).astype(np.uint8),
            depth_mm=noisy.clip(0).astype(np.uint16),
            intrinsics=CAMERA,
            base_from_camera=HUSKY.camera.base_from_camera,
            odom_from_base=self.pose,
        )

    def later(self, frames: int = 1) -> RgbdFrame:
        self.stamp_ns += frames * FRAME_NS
        return self.frame()


def attention(*groups: tuple[str, ...], wanted: tuple[str, ...] = ("cone",)) -> Attention:
    made = Attention(groups or (("cone", "car"),), RANGE)
    made.want(frozenset(wanted))
    return made


def found_nothing(one: Attention, frame: RgbdFrame) -> None:
    one.note(np.zeros((0, 4)), np.zeros(0, np.bool_), frame.odom_from_base)


def shapes(frame: RgbdFrame) -> Shapes:
    found = shapes_in(frame, RANGE)
    assert found is not None
    return found


def test_bare_ground_and_what_is_out_of_range_are_not_worth_a_look():
    assert len(shapes(Yard().frame()).boxes_px) == 0
    assert len(shapes(Yard([(12.0, 0.0, 1.0)]).frame()).boxes_px) == 0


@pytest.mark.parametrize("place", [(2.0, 0.0), (4.0, 1.5), (6.9, -2.0)])
def test_a_thing_on_the_ground_lies_within_what_is_looked_at(place: tuple[float, float]):
    frame = Yard([(*place, 0.6)]).frame()
    (box,), (region,) = shapes(frame).boxes_px, shapes(frame).regions_px
    red, blue = frame.color[..., 0].astype(int), frame.color[..., 2].astype(int)
    rows, columns = np.nonzero(red > blue + 60)
    assert region[0] <= columns.min() - 8 or region[0] == 0
    assert region[1] <= rows.min() - 8 or region[1] == 0
    assert region[2] >= columns.max() + 8 or region[2] == WIDTH
    assert region[3] >= rows.max() + 8 or region[3] == HEIGHT
    assert (region[2] - region[0]) * (region[3] - region[1]) < WIDTH * HEIGHT
    assert (box[:2] >= region[:2]).all()


def test_without_depth_anything_can_be_anywhere():
    frame = msgspec.structs.replace(Yard().frame(), depth_mm=np.zeros((HEIGHT, WIDTH), np.uint16))
    assert shapes_in(frame, RANGE) is None
    plan = attention().plan(frame)
    assert plan.looks
    assert plan.regions is None


boxes = st.lists(
    st.tuples(st.integers(0, 300), st.integers(0, 220), st.integers(4, 200), st.integers(4, 200)),
    max_size=6,
)


@given(boxes)
def test_parts_cover_the_regions_fit_the_network_and_do_not_overlap(found):
    corners = np.array([[x, y, min(x + w, 320), min(y + h, 240)] for x, y, w, h in found])
    gaze = Gaze(corners.reshape(-1, 4).astype(np.int32))
    parts = gaze.parts(Fit((1.0, 1.0), (0, 0), (320, 240)), 320, 256)
    cover = np.zeros((256, 320), int)
    for rows, columns in parts:
        assert (rows.stop - rows.start) % 32 == 0
        assert (columns.stop - columns.start) % 32 == 0
        cover[rows, columns] += 1
    assert cover.max(initial=0) <= 1
    assert all(cover[y0:y1, x0:x1].all() for x0, y0, x1, y1 in corners.reshape(-1, 4).tolist())
    assert bool(parts) == bool(found)


def test_all_of_a_picture_is_one_part():
    fit = Fit((1.0, 1.0), (0, 0), (320, 240))
    assert EVERYTHING.parts(fit, 320, 256) == [(slice(0, 256), slice(0, 320))]


def test_what_an_inner_edge_cuts_is_left_to_others_and_what_the_picture_cuts_is_not():
    part = slice(64, 128), slice(0, 96)
    inside, at_picture_edge = [20.0, 70, 60, 110], [0.0, 70, 60, 110]
    below, right = [20.0, 70, 60, 128], [20.0, 70, 95.5, 110]
    corners = np.array([inside, at_picture_edge, below, right])
    assert cut_off(corners, part, 320, 256).tolist() == [False, False, True, True]


def test_the_same_view_holds_the_longer_the_better_it_is_known_but_never_more_than_a_second():
    yard, one = Yard([(4.0, 0.0, 0.6)]), attention()
    looked = []
    for _ in range(40):
        frame = yard.later()
        if one.plan(frame).looks:
            looked.append(frame.stamp_ns)
            found_nothing(one, frame)
    gaps = np.diff(looked)
    assert gaps[0] == FRAME_NS
    assert (np.diff(gaps) >= 0).all()
    assert gaps.max() == SECOND_NS


def test_a_held_frame_names_the_one_that_was_seen():
    yard, one = Yard([(4.0, 0.0, 0.6)]), attention()
    for _ in range(3):
        one.plan(yard.later())
    seen_ns, held = yard.stamp_ns - FRAME_NS, one.plan(yard.frame())
    assert not held.looks
    assert held.reason == "same view as 0.2 s ago"
    assert one.seen_ns == seen_ns


def settled(yard: Yard) -> Attention:
    """Attention to a view that it knows so well that it holds now for several frames."""
    one = attention()
    for _ in range(30):
        frame = yard.later()
        if one.plan(frame).looks:
            found_nothing(one, frame)
    while not one.plan(yard.later()).looks:
        pass
    assert not one.plan(yard.later()).looks
    return one


@pytest.mark.parametrize(
    "change",
    [
        {"posts": [(4.0, 0.0, 0.6), (6.0, 1.5, 0.5)]},
        {"posts": []},
        {"posts": [(4.0, 0.2, 0.6)]},
        {"pose": Pose2(0.02, 0.0, 0.0)},
        {"pose": Pose2(0.0, 0.0, 0.01)},
    ],
    ids=["comes", "goes", "moves", "robot drives", "robot turns"],
)
def test_a_changed_scene_is_noticed_at_the_next_frame(change: dict):
    yard = Yard([(4.0, 0.0, 0.6)])
    one = settled(yard)
    for name, value in change.items():
        setattr(yard, name, value)
    assert one.plan(yard.later()).looks


def test_a_new_instruction_gets_a_full_look_at_once():
    yard = Yard([(4.0, 0.0, 0.6)])
    one = settled(yard)
    assert one.want(frozenset({"car"}))
    plan = one.plan(yard.later())
    assert plan.looks
    assert plan.passed is None
    assert not one.want(frozenset({"car"}))


def test_with_nothing_to_look_for_a_look_a_second_is_enough_even_on_the_way():
    yard, one = Yard([(4.0, 0.0, 0.6)]), attention(wanted=())
    looks = 0
    for step in range(50):
        yard.pose = Pose2(0.05 * step, 0.0, 0.0)
        looks += one.plan(yard.later()).looks
    assert looks == 10


def test_time_that_runs_backwards_holds_nothing():
    yard = Yard()
    one = settled(yard)
    yard.stamp_ns -= 100 * SECOND_NS
    assert one.plan(yard.frame()).looks


GROUPS = (("cone", "hydrant"), ("drill", "ball"), ("cone", "car"))
moves = st.lists(st.sampled_from(["stand", "drive", "thing comes", "other wish"]), max_size=25)


def plans_of(kinds: list[str]) -> list[tuple[RgbdFrame, Plan]]:
    yard, one = Yard([(4.0, 1.0, 0.6)]), attention(*GROUPS)
    plans = []
    wishes = itertools.cycle(["drill", "car", "hydrant"])
    for number, kind in enumerate(kinds):
        if kind == "drive":
            yard.pose = yard.pose @ Pose2(0.1, 0.0, 0.02)
        if kind == "thing comes":
            yard.posts = [*yard.posts, (3.0 + number % 3, -1.0 + 0.1 * number, 0.5)]
        if kind == "other wish":
            one.want(frozenset({next(wishes)}))
        frame = yard.later()
        plans.append((frame, one.plan(frame)))
        if plans[-1][1].looks:
            found_nothing(one, frame)
    return plans


@given(moves)
@settings(max_examples=15, deadline=None)
def test_what_is_wanted_is_looked_for_in_every_new_frame_and_the_rest_every_second(kinds):
    last_full = SECOND_NS
    for (frame, plan), kind in zip(plans_of(kinds), kinds, strict=True):
        assert plan.looks or kind == "stand"
        assert not plan.wanted & set(plan.unsought)
        if not plan.looks:
            continue
        knowing = {k for k, group in enumerate(GROUPS) if plan.wanted & set(group)}
        assert knowing <= plan.networks
        full = len(plan.networks) == len(GROUPS)
        assert full == (plan.unsought == ())
        last_full = frame.stamp_ns if full else last_full
        assert frame.stamp_ns - last_full <= SECOND_NS


@given(moves)
@settings(max_examples=5, deadline=None)
def test_the_same_frames_lead_to_the_same_plans(kinds):
    told = [[(p.looks, p.reason, p.networks) for _, p in plans_of(kinds)] for _ in range(2)]
    assert told[0] == told[1]


def on_the_way(yard: Yard, one: Attention) -> Plan:
    """One more frame, from a little farther on."""
    yard.pose = yard.pose @ Pose2(0.05, 0.0, 0.0)
    return one.plan(yard.later())


def test_what_showed_nothing_wanted_is_passed_over_until_the_next_full_look():
    yard, one = Yard([(5.0, 1.0, 0.8), (4.0, -1.0, 0.8)]), attention()
    first = one.plan(yard.later())
    assert first.passed is None
    box = shapes(yard.frame()).boxes_px[:1].astype(float)
    one.note(box, np.ones(1, np.bool_), yard.pose)
    passed = []
    for _ in range(5):
        plan = on_the_way(yard, one)
        assert plan.looks
        assert plan.shapes is not None
        passed.append(0 if plan.passed is None else len(plan.passed.boxes_px))
        assert passed[-1] + len(plan.shapes.boxes_px) == 2
    assert passed == [1, 1, 1, 1, 0]


def test_what_comes_out_behind_a_dull_thing_is_looked_at():
    yard, one = Yard([(5.0, 1.0, 0.8)]), attention()
    found_nothing(one, (frame := yard.later()))
    assert one.plan(frame).looks
    found_nothing(one, frame)
    assert len(on_the_way(yard, one).shapes.boxes_px) == 0  # type: ignore[union-attr]
    yard.posts.append((5.6, 1.35, 0.8))
    assert len(on_the_way(yard, one).shapes.boxes_px) == 1  # type: ignore[union-attr]


def test_what_was_passed_over_is_in_no_view():
    """Neither a place beside the thing nor one behind it counts as looked at."""
    frame = Yard([(4.0, 0.5, 0.8)]).frame()
    passed = shapes(frame)
    depth = frame.depth_mm / 1000.0
    whole = ground_view(depth, CAMERA, frame.base_from_camera, RANGE)
    view = whole.without(passed.left, passed.right)
    towards = int(np.abs(view.bearings - np.arctan2(0.5, 4.0)).argmin())
    assert whole.ranges[towards] > 3.5
    assert view.ranges[towards] < 3.4
    assert (view.ranges <= whole.ranges).all()
    assert_far_off_is_untouched(view, whole, towards)


def assert_far_off_is_untouched(view: GroundView, whole: GroundView, towards: int) -> None:
    far = np.abs(np.arange(len(view.bearings)) - towards) > 6
    np.testing.assert_array_equal(view.ranges[far], whole.ranges[far])
