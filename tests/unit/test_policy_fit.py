"""Laws of learning the policy's weights."""

import numpy as np
import pytest

from services.policy.training.fit import (
    FitSettings,
    State,
    agreement,
    fit,
    loss,
    mean_loss,
    subgradient,
)

COUNT, SIZE = 12, 5


def state_of(rng: np.random.Generator, weights: np.ndarray | None = None) -> State:
    """Random candidates, the first a stop; the label is the cheapest by `weights`, if given."""
    values = rng.normal(size=(COUNT, SIZE))
    block = (np.arange(COUNT) == 0).astype(np.intp)
    cost = rng.random(COUNT) if weights is None else np.sum(values * weights[block], axis=1)
    regret = cost - cost.min()
    return State(values, block, int(np.argmin(cost)), np.minimum(regret, 1.0))


def states_of(count: int, seed: int = 0) -> tuple[list[State], np.ndarray]:
    rng = np.random.default_rng(seed)
    weights = rng.normal(size=(2, SIZE))
    return [state_of(rng, weights) for _ in range(count)], weights


def test_loss_is_zero_where_the_expert_wins_by_the_margin():
    states, weights = states_of(20)
    # The margin is the regret under these weights, at most: all others are dearer by it.
    assert all(loss(weights, one, 0.0) == pytest.approx(0.0, abs=1e-12) for one in states)
    assert all(loss(0.5 * weights, one, 0.0) > 0 for one in states)


def test_loss_is_never_negative_and_penalised():
    rng = np.random.default_rng(1)
    for _ in range(20):
        state, weights = state_of(rng), rng.normal(size=(2, SIZE))
        assert loss(weights, state, 0.0) >= 0
        penalised = loss(weights, state, 0.1) - loss(weights, state, 0.0)
        assert penalised == pytest.approx(0.05 * np.sum(weights**2))


def test_loss_is_convex():
    rng = np.random.default_rng(2)
    for _ in range(20):
        state = state_of(rng)
        first, second = rng.normal(size=(2, 2, SIZE))
        between = loss(0.5 * (first + second), state, 0.01)
        assert between <= 0.5 * (loss(first, state, 0.01) + loss(second, state, 0.01)) + 1e-12


def test_subgradient_agrees_with_finite_differences():
    rng = np.random.default_rng(3)
    for _ in range(10):
        state, weights = state_of(rng), rng.normal(size=(2, SIZE))
        gradient, step = subgradient(weights, state, 0.01), 1e-6
        for row, column in np.ndindex(weights.shape):
            moved = np.zeros_like(weights)
            moved[row, column] = step
            up, down = loss(weights + moved, state, 0.01), loss(weights - moved, state, 0.01)
            assert gradient[row, column] == pytest.approx((up - down) / (2 * step), abs=1e-5)


def test_order_of_candidates_means_nothing():
    rng = np.random.default_rng(4)
    state, weights = state_of(rng), rng.normal(size=(2, SIZE))
    order = rng.permutation(COUNT)
    label = int(np.flatnonzero(order == state.label)[0])
    shuffled = State(state.values[order], state.block[order], label, state.margin[order])
    assert loss(weights, shuffled, 0.1) == pytest.approx(loss(weights, state, 0.1))
    np.testing.assert_allclose(
        subgradient(weights, shuffled, 0.1), subgradient(weights, state, 0.1)
    )


def test_smaller_features_with_larger_weights_cost_the_same():
    rng = np.random.default_rng(5)
    state, weights = state_of(rng), rng.normal(size=(2, SIZE))
    scaled = State(state.values / 10, state.block, state.label, state.margin)
    assert loss(10 * weights, scaled, 0.0) == pytest.approx(loss(weights, state, 0.0))


def test_learns_what_a_linear_expert_does():
    states, _ = states_of(400)
    seen, others = states[:200], states[200:]
    fitted = fit(seen, np.zeros((2, SIZE)), FitSettings(), np.random.default_rng(0))
    assert agreement(fitted.weights, others) > 0.9
    assert mean_loss(fitted.weights, others) < 0.2 * mean_loss(np.zeros((2, SIZE)), others)
    assert fitted.losses[-1] < fitted.losses[0]
    assert fitted.agreements[-1] > fitted.agreements[0]


def test_the_same_seed_learns_the_same():
    states, _ = states_of(50)
    start = np.zeros((2, SIZE))
    once, again = (fit(states, start, FitSettings(), np.random.default_rng(7)) for _ in range(2))
    np.testing.assert_array_equal(once.weights, again.weights)
    assert once.losses == again.losses
