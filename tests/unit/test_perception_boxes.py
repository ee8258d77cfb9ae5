"""Which way things are turned, and what they are made of for whoever must not touch them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from schemas.perception import SOLID_KINDS
from services.perception.space.facing import facing_of
from services.perception.space.solids import solids_of

SIZE = np.array([0.4, 0.15, 0.25])


def front_of_box(center: np.ndarray, yaw: float, rng: np.random.Generator) -> np.ndarray:
    """Points on the faces of a box of `SIZE` that a camera at the origin, 1 m high, sees."""
    eye = np.array([0.0, 0.0, 1.0])
    turned = np.array(
        [[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]]
    )
    points = []
    for axis in range(3):
        for side in (-0.5, 0.5):
            on_face = rng.uniform(-0.5, 0.5, (80, 3)) * SIZE
            on_face[:, axis] = side * SIZE[axis]
            normal = turned[:, axis] * side
            world = center + on_face @ turned.T
            points.append(world[((eye - world) @ normal) > 0])
    return np.concatenate(points) + 0.004 * rng.normal(size=(sum(map(len, points)), 3))


@settings(max_examples=40, deadline=None)
@given(yaw=st.floats(-1.57, 1.57), bearing=st.floats(-0.6, 0.6), seed=st.integers(0, 99))
def test_a_long_box_is_seen_to_be_turned(yaw: float, bearing: float, seed: int):
    center = np.array([2 * math.cos(bearing), 2 * math.sin(bearing), SIZE[2] / 2])
    points = front_of_box(center, yaw, np.random.default_rng(seed))
    facing = facing_of(points, center, SIZE, 2.0)
    off = abs((facing.yaw - yaw + math.pi / 2) % math.pi - math.pi / 2)
    assert off < math.radians(12)
    assert -math.pi / 2 <= facing.yaw < math.pi / 2
    assert facing.deviation < math.radians(30)


def test_a_round_thing_faces_nowhere():
    angle = np.random.default_rng(0).uniform(math.pi / 2, 3 * math.pi / 2, 400)
    height = np.random.default_rng(1).uniform(-0.2, 0.2, 400)
    drum = np.stack([0.25 * np.cos(angle), 0.25 * np.sin(angle), height], axis=1)
    facing = facing_of(
        drum + np.array([3.0, 0.0, 0.2]), np.array([3.0, 0, 0.2]), np.array([0.5, 0.5, 0.4]), 3.0
    )
    assert facing.deviation > math.radians(35)


@given(st.tuples(*[st.floats(0.05, 1.0)] * 3), st.sampled_from(["ball", "cone", "open box", "car"]))
def test_solids_lie_within_the_box_of_the_object(size: tuple[float, ...], label: str):
    whole = np.array([max(size[:2]), min(size[:2]), size[2]])
    for solid in solids_of(label, whole):
        assert solid.kind in SOLID_KINDS
        reach = np.abs(solid.center) + solid.size / 2
        assert (reach <= np.maximum(whole, whole.mean()) / 2 + 0.5 * whole.max()).all()


def test_an_open_box_is_open():
    inside = np.array([0.0, 0.0, 0.05])
    solids = solids_of("open box", np.array([0.34, 0.34, 0.22]))
    hit = [(np.abs(inside - one.center) <= one.size / 2).all() for one in solids]
    assert not any(hit)
    floor = np.array([0.0, 0.0, -0.105])
    assert any((np.abs(floor - one.center) <= one.size / 2).all() for one in solids)


@pytest.mark.parametrize(
    ("label", "kind"), [("ball", "ball"), ("barrel", "cylinder"), ("sofa", "box")]
)
def test_things_have_the_kind_of_their_class(label: str, kind: str):
    (solid,) = solids_of(label, np.array([0.3, 0.3, 0.3]))
    assert solid.kind == kind
