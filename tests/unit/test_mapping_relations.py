"""Relations are densities, and what is sampled from them is what they say."""

from dataclasses import replace
from typing import get_args

import msgspec
import numpy as np
import pytest

from schemas.arrays import Floats
from schemas.geometry import Pose2
from services.mapping import prior
from services.mapping.relation_table import (
    UnknownFeatureError,
    axis_of,
    defaults,
    relation_named,
    relation_of,
    relation_table,
)
from services.mapping.relations import Frame, features_of, frame_at, frame_of_robot, residual
from services.mapping.training.practice import practised
from services.mapping.training.relation_training import train_relations

VIEWER = Pose2(1.0, 2.0, 0.7)
NAMES = sorted(relation_table())
DIRECTED = ("back", "front", "left", "right", "past", "down", "through")


def phi_of(frame: Frame) -> Floats:
    n = len(frame.distance)
    return features_of(frame, np.full(n, 0.2), np.full((n, 2), 0.2))


def test_learned_relations_are_in_use() -> None:
    assert relation_named("back", False) is not defaults["back"]
    assert relation_named("behind", False) is relation_named("back", False)
    assert relation_named("near", True) is not relation_named("near", False)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("learned", [True, False])
def test_a_density_integrates_to_one(name: str, learned: bool) -> None:
    relation = relation_table()[name] if learned else defaults[name]
    step = 0.15
    axis = np.arange(-45, 45, step)
    offset = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    frame = frame_at(np.tile([5.0, 1.0], (len(offset), 1)), VIEWER)
    log_p = relation.log_density(frame, offset, phi_of(frame), residual**2)
    assert np.exp(log_p).sum() * step**2 == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("name", NAMES)
def test_samples_have_the_density_of_their_relation(name: str) -> None:
    relation, n = relation_table()[name], 40_000
    frame = frame_at(np.tile([5.0, 1.0], (n, 1)), VIEWER)
    points = np.random.default_rng(1).random((n, 3))
    phi = phi_of(frame)
    offset = relation.sample(points, frame, phi)
    own = relation.log_density(frame, offset, phi, 0.0)
    narrow = replace(relation, outlier_share=0.5 * relation.outlier_share)
    # E[q / p] over samples of p is the integral of q.
    ratio = np.exp(narrow.log_density(frame, offset, phi, 0.0) - own)
    assert ratio.mean() == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("name", "direction"),
    [("back", (1, 0)), ("front", (-1, 0)), ("left", (0, 1)), ("right", (0, -1))],
)
def test_sides_are_those_of_the_viewer(name: str, direction: tuple[int, int]) -> None:
    frame = frame_at(np.array([[6.0, 0.0]]), Pose2(0.0, 0.0, 2.0))
    sides = [(1, 0), (-1, 0), (0, 1), (0, -1)]
    scores = [
        relation_named(name, False).log_density(
            frame, 2.5 * np.array([side], float), phi_of(frame), 0.0
        )[0]
        for side in sides
    ]
    assert sides[int(np.argmax(scores))] == direction


def test_behind_the_robot_is_behind_its_back() -> None:
    frame = frame_of_robot(Pose2(0.0, 0.0, np.pi / 2), 1)
    np.testing.assert_allclose(frame.u, [[0, -1]], atol=1e-12)
    np.testing.assert_allclose(frame.v, [[-1, 0]], atol=1e-12)


def test_turning_the_world_turns_the_relation() -> None:
    turn = Pose2(3.0, -1.0, 1.1)
    landmark, figure = np.array([[5.0, 1.0]]), np.array([[7.0, 2.0]])
    values = []
    for c, f, v in [
        (landmark, figure, VIEWER),
        (turn.apply(landmark), turn.apply(figure), turn @ VIEWER),
    ]:
        frame = frame_at(c, v)
        values.append(relation_named("back", False).log_density(frame, f - c, phi_of(frame), 0.0))
    np.testing.assert_allclose(values[0], values[1])


def test_a_large_landmark_moves_the_figure_away() -> None:
    frame = frame_at(np.array([[12.0, 0.0]]), Pose2(0.0, 0.0, 0.0))
    middle = np.full((1, 3), 0.5)
    for relation in (relation_named("back", False), defaults["back"]):
        near, far = (
            relation.sample(middle, frame, features_of(frame, np.array([0.2]), half))[0, 0]
            for half in (np.array([[0.2, 0.2]]), np.array([[3.0, 3.0]]))
        )
        assert near + 2.0 < far
        assert far > 3.0


def test_weights_of_unknown_features_are_refused() -> None:
    with pytest.raises(UnknownFeatureError, match=r"colour.*features are: one, figure_radius"):
        axis_of({"colour": 1.0}, {})


@pytest.mark.slow
def test_learning_again_gives_the_same_and_beats_the_defaults() -> None:
    first, again = (train_relations(400, 3, lambda line: None) for _ in range(2))
    assert msgspec.json.encode(first) == msgspec.json.encode(again)
    for name in DIRECTED:
        assert first.relations[name].held_out > first.relations[name].held_out_default


def test_weights_read_back_are_those_that_were_learned() -> None:
    learned = train_relations(60, 3, lambda line: None)
    text = msgspec.json.encode(learned)
    read = msgspec.json.decode(text, type=type(learned)).relations["back"]
    frame = frame_at(np.array([[6.0, 0.0]]), Pose2(0.0, 0.0, 0.0))
    after, before = (
        relation_of(one).sample(np.full((1, 3), 0.4), frame, phi_of(frame))
        for one in (read, learned.relations["back"])
    )
    np.testing.assert_array_equal(after, before)


def test_behind_is_practised_on_the_far_side_and_what_is_not_practised_has_no_examples() -> None:
    behind = practised("back", 60)
    assert behind.offset.shape == (60, 2)
    assert np.all(behind.offset[:, 0] > 0)
    assert len(practised("left", 60).offset) == 0


@pytest.mark.parametrize("role", [*get_args(prior.Role), *prior.as_room.values()])
def test_the_prior_is_the_density_of_its_samples(role: prior.Meant) -> None:
    rng = np.random.default_rng(0)
    places = prior.places_at(role, rng.random((20_000, 3)), VIEWER)
    shifted = places + 0.5
    # E[q / p] over samples of p is the integral of q.
    ratio = np.exp(prior.log_place(role, shifted, VIEWER) - prior.log_place(role, places, VIEWER))
    assert ratio.mean() == pytest.approx(1.0, abs=0.05)


def test_rooms_behind_whoever_speaks_are_likelier_than_things_there() -> None:
    ahead, behind = VIEWER.apply(np.array([[9.0, 0.0], [-9.0, 0.0]]))[:, None]
    odds = {
        role: float(
            (prior.log_place(role, ahead, VIEWER) - prior.log_place(role, behind, VIEWER))[0]
        )
        for role in ("landmark room", "landmark")
    }
    assert 0 < odds["landmark room"] <= odds["landmark"]
