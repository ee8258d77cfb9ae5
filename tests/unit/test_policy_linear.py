"""The learned cost as it is kept and used."""

from dataclasses import replace
from typing import get_args

import msgspec
import numpy as np
import pytest

from services.policy.belief_features import names
from services.policy.cost import Circumstances
from services.policy.linear import (
    Block,
    ExpertName,
    LinearWeights,
    Provenance,
    WeightsError,
    cost_of,
    default_expert,
    load_linear,
    save_linear,
    weights_path,
)

KINDS = ("any", "relation")
NOW = Circumstances(searching_s=0.0, words="relation", following=False)


def weights_of(named=names, moments=2, seed=0, **changed) -> LinearWeights:
    """Random weights for some features."""
    rng = np.random.default_rng(seed)

    def table(low: float) -> dict[str, tuple[float, ...]]:
        return {name: tuple(rng.uniform(low, 1.0, moments).tolist()) for name in named}

    def block() -> Block:
        return Block(
            mean=table(-1.0), deviation=table(0.5), weights={kind: table(-1.0) for kind in KINDS}
        )

    provenance = Provenance(
        git="abc", seed=0, expert="clairvoyant", rounds=1, decisions=2, agreement=0.5, success=1.0
    )
    settings = {
        "patience": 0.0,
        "confirmed": 0.9,
        "confirmed_late": 0.6,
        "late_s": (60.0, 150.0),
        "confirmed_still": 0.9,
        "stop_above": 0.0,
        **changed,
    }
    return LinearWeights(
        provenance=provenance, moments=moments, move=block(), stop=block(), **settings
    )


def features_of(count=6, moments=3, here=1.0, found=0.5, seed=1) -> np.ndarray:
    """Random candidates, the first a stop."""
    features = np.random.default_rng(seed).random((count, moments, len(names)))
    features[:, :, names.index("is_stop")] = 0
    features[0, 0, names.index("is_stop")] = 1
    features[:, 0, names.index("here")] = 0
    features[0, 0, names.index("here")] = here
    features[0, 0, names.index("reach_found")] = found
    return features


@pytest.mark.parametrize("moments", [1, 2, 3])
def test_cost_is_the_weighted_sum_of_standardised_moments(moments):
    weights, features = weights_of(moments=moments), features_of()
    costs = cost_of(weights).costs(features, "relation")
    for row, block in ((0, weights.stop), (3, weights.move)):
        expected = sum(
            block.weights["relation"][name][k]
            * (features[row, k, column] - block.mean[name][k])
            / block.deviation[name][k]
            for column, name in enumerate(names)
            for k in range(moments)
        )
        assert costs[row] == pytest.approx(expected)


def test_order_of_candidates_means_nothing():
    cost, features = cost_of(weights_of()), features_of()
    order = np.random.default_rng(3).permutation(len(features))
    judged, shuffled = cost.judge(features, NOW), cost.judge(features[order], NOW)
    np.testing.assert_allclose(shuffled.costs, judged.costs[order])
    np.testing.assert_allclose(shuffled.gains, judged.gains[order])
    np.testing.assert_array_equal(shuffled.worthwhile, judged.worthwhile[order])


def test_each_kind_of_words_has_its_own_weights_or_those_for_any():
    cost, features = cost_of(weights_of()), features_of()
    assert not np.allclose(cost.costs(features, "relation"), cost.costs(features, "any"))
    np.testing.assert_array_equal(cost.costs(features, "none"), cost.costs(features, "any"))


def test_what_is_followed_is_cheaper_by_the_patience():
    cost, features = cost_of(weights_of(patience=0.4)), features_of()
    following = Circumstances(searching_s=0.0, words="relation", following=True)
    saved = cost.judge(features, NOW).costs - cost.judge(features, following).costs
    np.testing.assert_allclose(saved[1:], [0.4, 0, 0, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("here", "found", "stop_above", "allowed"),
    [(1.0, 0.5, 0.0, True), (0.0, 0.5, 0.0, False), (1.0, 0.5, 0.6, False), (1.0, 0.7, 0.6, True)],
)
def test_a_stop_needs_something_to_declare_and_the_posterior_it_is_bound_to(
    here, found, stop_above, allowed
):
    cost = cost_of(weights_of(stop_above=stop_above))
    judged = cost.judge(features_of(here=here, found=found), NOW)
    assert judged.worthwhile[0] == allowed
    assert allowed or judged.costs[0] > judged.costs[1:].max()


@pytest.mark.parametrize(("here", "due"), [(1.0, 0), (0.0, 3)])
@pytest.mark.parametrize("seed", range(5))
def test_what_was_confirmed_is_declared_or_gone_to_before_all_else(here, due, seed):
    features = features_of(here=here, found=0.95, seed=seed)
    features[1:, 0, names.index("reach_found")] = 0.05
    features[3, 0, names.index("reach_found")] = 0.95
    judged = cost_of(weights_of(seed=seed)).judge(features, NOW)
    assert np.argmin(judged.costs) == due
    assert judged.worthwhile.tolist() == [row == due for row in range(len(features))]


def test_a_move_that_shows_nothing_is_not_worthwhile():
    features = features_of()
    features[2] = 0
    judged = cost_of(weights_of()).judge(features, NOW)
    assert not judged.worthwhile[2]
    assert judged.costs[2] > judged.costs[np.array([1, 3, 4, 5])].max()


@pytest.mark.parametrize(("tried", "worthwhile"), [(0.0, True), (2.0, True), (8.0, False)])
def test_a_place_that_was_tried_often_is_left_whatever_the_weights_say(tried, worthwhile):
    features = features_of(found=0.3)
    features[1:, 0, names.index("reach_found")] = 0.3
    features[1:, 0, names.index("tried")] = 0.0
    features[2, 0, names.index("tried")] = tried
    judged = cost_of(weights_of()).judge(features, NOW)
    assert judged.worthwhile[2] == worthwhile
    assert judged.worthwhile[np.array([1, 3, 4, 5])].all()


def test_files_are_read_as_they_were_written(tmp_path):
    weights, features = weights_of(), features_of()
    save_linear(tmp_path / "w.json", weights)
    again = load_linear(tmp_path / "w.json")
    assert again.settings == weights
    np.testing.assert_array_equal(
        again.costs(features, "relation"), cost_of(weights).costs(features, "relation")
    )


def test_features_that_are_newer_than_the_weights_have_no_weight():
    some = names[: len(names) - 2]
    cost, features = cost_of(weights_of(named=some)), features_of()
    changed = features.copy()
    changed[:, :, len(some) :] += 5
    np.testing.assert_array_equal(cost.costs(features, "any"), cost.costs(changed, "any"))


def test_unknown_features_are_named_with_those_that_exist():
    with pytest.raises(WeightsError, match=r"(?s)see_figur,.*see_either.*train policy"):
        cost_of(weights_of(named=(*names, "see_figur", "zeal")))


def test_a_table_that_lacks_a_number_is_refused():
    weights = weights_of()
    short = {**weights.stop.mean, "length": (1.0,)}
    broken = msgspec.structs.replace(
        weights, stop=msgspec.structs.replace(weights.stop, mean=short)
    )
    with pytest.raises(WeightsError, match="2 numbers each for length"):
        cost_of(broken)


def test_what_is_no_file_of_weights_is_refused(tmp_path):
    (tmp_path / "w.json").write_text('{"mean": {}}')
    with pytest.raises(WeightsError, match="no weights of a policy"):
        load_linear(tmp_path / "w.json")


def test_weights_in_the_tree_go_with_the_features_that_exist():
    folder = weights_path("husky", default_expert).parent
    for expert in get_args(ExpertName):
        for path in folder.glob(f"*.{expert}*.json"):
            if path.suffixes[-2] != ".report":
                assert load_linear(path).settings.provenance.expert == expert


def test_moves_are_told_apart_however_long_all_ways_are():
    cost, near = cost_of(weights_of()), features_of()
    far = near.copy()
    far[1:, 0, names.index("way")] += 500.0
    near_costs, far_costs = cost.costs(near, "relation"), cost.costs(far, "relation")
    np.testing.assert_allclose(np.diff(near_costs[1:]), np.diff(far_costs[1:]), atol=1e-9)
    assert near_costs[0] == pytest.approx(far_costs[0])


def test_one_strange_candidate_does_not_cost_without_limit():
    cost, usual = cost_of(weights_of()), features_of(count=9)
    strange, stranger = usual.copy(), usual.copy()
    strange[4, 0, names.index("way")] += 500.0
    stranger[4, 0, names.index("way")] += 5000.0
    np.testing.assert_allclose(
        cost.costs(strange, "relation"), cost.costs(stranger, "relation"), atol=1e-9
    )


def test_less_certainty_will_do_after_a_long_search():
    cost = cost_of(weights_of(stop_above=0.6))
    features = features_of(found=0.85)
    features[1:, 0, names.index("see_either")] = 1.0
    late = Circumstances(searching_s=150.0, words="relation", following=False)
    for seconds, gate in ((0.0, 0.9), (105.0, 0.75), (1000.0, 0.6)):
        assert cost.gate(replace(late, searching_s=seconds)) == pytest.approx(gate)
    assert int(np.argmin(cost.judge(features, late).costs)) == 0
