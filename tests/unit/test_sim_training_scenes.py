import itertools

import numpy as np
import pytest

from sim.assets.library import DETECTED, make_asset
from sim.scenes import training_parts
from sim.scenes.training import random_scene
from sim.scenes.training_model import rested
from sim.scenes.training_parts import PARTS, UnknownPartError, get_part
from sim.scenes.training_things import LYING
from sim.scenes.training_views import random_view

SCENES = range(4)


def scenes(part):
    return [random_scene(get_part(part), 0, number) for number in SCENES]


def test_no_look_that_is_trained_on_is_judged_by(monkeypatch):
    drawn = {}
    for part in PARTS:
        looks = drawn[part] = set()

        def recorded(label, look, looks=looks):
            looks.add(look)
            return make_asset(label, look)

        monkeypatch.setattr(training_parts, "make_asset", recorded)
        looks |= {scene.sky for scene, _ in scenes(part)}
    assert all(len(looks) > 50 for looks in drawn.values())
    for first, second in itertools.combinations(PARTS, 2):
        assert not drawn[first] & drawn[second]
    # Not by chance: each set that is learned from has a pool of its own.
    remainders = {part: {look % 4 for look in looks} for part, looks in drawn.items()}
    assert remainders == {"train": {0, 2}, "val": {1}, "test": {3}, "empty": {3}}


def test_the_same_seed_gives_the_same_scene_and_another_set_another():
    (first, _), (again, _) = (random_scene(PARTS["train"], 3, 5) for _ in range(2))
    assert [item.world_from_object for item in first.items] == [
        item.world_from_object for item in again.items
    ]
    assert first.sun == again.sun
    other, _ = random_scene(PARTS["val"], 3, 5)
    assert other.sun != first.sun


def test_all_classes_turn_up_and_none_where_there_shall_be_none():
    labels = {item.label for scene, _ in scenes("train") + scenes("val") for item in scene.items}
    assert set(DETECTED) <= labels
    empty = {item.label for scene, _ in scenes("empty") for item in scene.items}
    assert len(empty) > 10
    assert not empty & set(DETECTED)


def test_things_lie_on_something_or_in_a_box():
    inside = 0
    for scene, _ in scenes("train"):
        boxes = [item for item in scene.items if item.label == "box"]
        for item in scene.items:
            low = item.corners[:, 2].min()
            # Trees and stones go a little way into the ground.
            assert low == pytest.approx(item.support.height, abs=0.05)
            if item.label != "room" and not item.support.shaded:
                inside += 1
                assert any(_is_within(item, box) for box in boxes)
    assert inside > 3


def _is_within(item, box):
    """Whether all of a thing, seen from above, is between the walls of a box."""
    wall, floor = box.asset.collisions[1], box.asset.collisions[0]
    half = np.array(floor.half[:2]) - 2 * wall.half[0]
    local = box.world_from_object.inverse().apply(item.corners)
    return (np.abs(local[:, :2]) <= half + 1e-9).all() and local[:, 2].min() >= 2 * floor.half[
        2
    ] - 0.03


@pytest.mark.parametrize("label", LYING)
def test_what_lies_touches_the_ground_and_stays_where_it_was_put(label):
    asset = make_asset(label, 4)
    for tilt in LYING[label][0]:
        item = rested(asset, 2.0, -1.0, 0.7, tilt=tilt)
        assert item.corners[:, 2].min() == pytest.approx(0.0, abs=1e-9)
        assert item.center[:2] == pytest.approx([2.0, -1.0])
        side = asset.size[1] if tilt[0] else asset.size[0]
        assert item.top == pytest.approx(side)


@pytest.mark.parametrize("part", ["train", "empty"])
def test_cameras_are_in_the_room_and_in_nothing_else(part):
    for scene, rng in scenes(part):
        for _ in range(10):
            x, y, z = random_view(rng, scene).world_from_camera.position
            assert 0.2 < z < (scene.room[2] if scene.room else 12)
            for item in scene.items:
                apart = np.hypot(x - item.center[0], y - item.center[1])
                assert item.label == "room" or apart > item.radius or z > item.top
            if scene.room:
                assert abs(x) < scene.room[0] / 2
                assert abs(y) < scene.room[1] / 2


def test_an_unknown_set_is_answered_with_the_known_ones():
    with pytest.raises(UnknownPartError, match=r"holiday.*train, val, test, empty"):
        get_part("holiday")
