"""Laws of furnished rooms: they are what was asked for, nothing overlaps, seeds repeat."""

import itertools

import numpy as np
import pytest

from robots.symbols import SYMBOL_SPACES
from sim.assets.furniture_library import FURNITURE, UnknownFurnitureError, make_furniture
from sim.assets.tag import make_tag, tag_texture
from sim.scenes.rooms import CABIN, ROOM_KINDS, Suite, empty_suite, overlap
from sim.scenes.rooms_furnished import furnished_suite
from sim.scenes.rooms_views import random_pose


def suites(count: int = 3) -> list[Suite]:
    return [
        furnished_suite(np.random.default_rng([seed, *kind.encode()]), kind)
        for kind in ROOM_KINDS
        for seed in range(count)
    ]


def test_there_are_rooms_of_every_kind_that_a_robot_has_a_word_for():
    words = {name for space in SYMBOL_SPACES.values() for name in space.locations}
    assert set(ROOM_KINDS) == words - {"generic"}


def test_a_suite_begins_with_the_room_that_was_asked_for_and_has_doors_to_the_others():
    for kind in ROOM_KINDS:
        for seed in range(20):
            suite = empty_suite(np.random.default_rng(seed), kind)
            assert suite.rooms[0].kind == kind
            assert len(suite.doors) == len(suite.rooms) - 1
            for room, door in zip(suite.rooms[1:], suite.doors, strict=True):
                for one in (suite.rooms[0], room):
                    assert overlap(one.floor, door, 1e-6), "a doorway ends at both rooms"
                    assert not overlap(one.floor, door, -1e-6), "and lies in neither"


def test_rooms_do_not_overlap():
    for seed in range(40):
        suite = empty_suite(np.random.default_rng(seed), ROOM_KINDS[seed % len(ROOM_KINDS)])
        for one, other in itertools.combinations(suite.rooms, 2):
            assert not overlap(one.floor, other.floor, 0.1)


def test_furniture_stands_in_rooms_and_keeps_apart_and_out_of_doorways():
    for suite in suites():
        for one, other in itertools.combinations(suite.blocked, 2):
            assert not overlap(one, other)
        for box in suite.blocked:
            assert any(room.holds(*box[:2]) and room.holds(*box[2:]) for room in suite.rooms)
            assert not any(overlap(box, door) for door in suite.doors)


@pytest.mark.parametrize(
    ("kind", "one_of"),
    [
        ("kitchen", {"counter"}),
        ("office", {"desk"}),
        ("lab", {"lab bench"}),
        ("lounge", {"sofa", "armchair"}),
        ("elevator", {"lift doors", "cabin wall"}),
        ("conference room", {"conference table"}),
        ("cafeteria", {"cafeteria table"}),
        ("hallway", {"closed door"}),
    ],
)
def test_most_rooms_have_what_makes_them_what_they_are(kind: str, one_of: set[str]):
    found = 0
    for seed in range(12):
        suite = furnished_suite(np.random.default_rng(seed), kind)
        room = suite.rooms[0]
        inside = {p.label for p in suite.pieces if room.holds(p.pose.x, p.pose.y, -0.1)}
        found += bool(inside & one_of)
    assert found >= 10


def test_a_lift_has_walls_on_all_sides_but_the_door_s():
    cabins = (empty_suite(np.random.default_rng(seed), "elevator") for seed in range(99))
    seed = next(n for n, suite in enumerate(cabins) if suite.rooms[0].is_cabin)
    suite = furnished_suite(np.random.default_rng(seed), "elevator")
    assert suite.rooms[0].width == CABIN
    inside = [p for p in suite.pieces if suite.rooms[0].holds(p.pose.x, p.pose.y)]
    assert [piece.label for piece in inside] == ["cabin wall"] * 3


def test_same_seed_same_suite_and_view():
    def drawn() -> tuple[Suite, object]:
        rng = np.random.default_rng(5)
        suite = furnished_suite(rng, "office")
        return suite, random_pose(rng, suite)

    assert drawn() == drawn()


@pytest.mark.parametrize("label", FURNITURE)
def test_furniture_is_of_a_size_that_fits_rooms_and_repeats(label: str):
    asset = make_furniture(label, 4)
    again = FURNITURE[label](np.random.default_rng([4, *label.encode()]))
    assert min(asset.size) > 0.01
    assert max(asset.size[:2]) < 5.5
    assert asset.bounds[0][2] > -0.01
    assert asset.bounds[1][2] < 2.6
    np.testing.assert_array_equal(asset.meshes[0].vertices, again.meshes[0].vertices)
    np.testing.assert_array_equal(asset.meshes[0].texture, again.meshes[0].texture)


def test_unknown_furniture_lists_what_there_is():
    with pytest.raises(UnknownFurnitureError, match="sofa"):
        make_furniture("throne", 0)


def test_a_tag_is_a_square_plate_with_a_white_rim():
    asset = make_tag(5, 0.16)
    assert asset.size[1:] == pytest.approx((0.2, 0.2))
    texture = tag_texture(5)
    assert texture[:16].min() == 255
    assert texture[16:32, 16:-16].max() == 0
    assert (tag_texture(6) != texture).any()
