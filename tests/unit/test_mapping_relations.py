"""Relations are densities, and what is sampled from them is what they say."""

import numpy as np
import pytest

from schemas.geometry import Pose2
from services.mapping import prior, relations
from services.mapping.relations import frame_at, frame_of_robot, relation_named

VIEWER = Pose2(1.0, 2.0, 0.7)
NAMES = sorted(relations.relations)


@pytest.mark.parametrize("name", [*NAMES, "unknown"])
def test_a_density_integrates_to_one(name: str) -> None:
    step = 0.1
    axis = np.arange(-30, 30, step)
    offset = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    n = len(offset)
    frame = frame_at(np.tile([5.0, 1.0], (n, 1)), VIEWER)
    log_p = relations.log_likelihood(
        relation_named(name, False), frame, offset, np.full(n, 0.4), np.full(n, 0.25)
    )
    assert np.exp(log_p).sum() * step**2 == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("name", NAMES)
def test_samples_are_likely_under_their_own_relation(name: str) -> None:
    rng, n = np.random.default_rng(1), 2000
    frame, radii = frame_at(np.tile([5.0, 1.0], (n, 1)), VIEWER), np.full(n, 0.4)
    offset = relations.sample_figure(relation_named(name, False), rng, frame, radii)
    spread = np.full(n, relations.residual**2)
    own = relations.log_likelihood(relation_named(name, False), frame, offset, radii, spread)
    away = relations.log_likelihood(relation_named(name, False), frame, offset + 9, radii, spread)
    assert np.mean(own > away) > 0.85


@pytest.mark.parametrize(
    ("name", "direction"),
    [("back", (1, 0)), ("front", (-1, 0)), ("left", (0, 1)), ("right", (0, -1))],
)
def test_sides_are_those_of_the_viewer(name: str, direction: tuple[int, int]) -> None:
    viewer = Pose2(0.0, 0.0, 2.0)
    frame = frame_at(np.array([[6.0, 0.0]]), viewer)
    scores = [
        relations.log_likelihood(
            relation_named(name, False),
            frame,
            3.0 * np.array([side], float),
            np.full(1, 0.4),
            np.zeros(1),
        )[0]
        for side in [(1, 0), (-1, 0), (0, 1), (0, -1)]
    ]
    best = [(1, 0), (-1, 0), (0, 1), (0, -1)][int(np.argmax(scores))]
    assert best == direction


def test_behind_the_robot_is_behind_its_back() -> None:
    frame = frame_of_robot(Pose2(0.0, 0.0, np.pi / 2), 1)
    np.testing.assert_allclose(frame.u, [[0, -1]], atol=1e-12)
    np.testing.assert_allclose(frame.v, [[-1, 0]], atol=1e-12)


def test_turning_the_world_turns_the_relation() -> None:
    turn = Pose2(3.0, -1.0, 1.1)
    landmark, figure = np.array([[5.0, 1.0]]), np.array([[7.0, 2.0]])
    radii, zero = np.full(1, 0.4), np.zeros(1)
    values = [
        relations.log_likelihood(relation_named("back", False), frame_at(c, v), f - c, radii, zero)
        for c, f, v in [
            (landmark, figure, VIEWER),
            (turn.apply(landmark), turn.apply(figure), turn @ VIEWER),
        ]
    ]
    np.testing.assert_allclose(values[0], values[1])


def test_the_prior_is_the_density_of_its_samples() -> None:
    rng = np.random.default_rng(0)
    places = prior.sample_places(rng, VIEWER, 20_000)
    shifted = places + 0.5
    # E[q / p] over samples of p is the integral of q.
    ratio = np.exp(prior.log_place(shifted, VIEWER) - prior.log_place(places, VIEWER))
    assert ratio.mean() == pytest.approx(1.0, abs=0.05)
