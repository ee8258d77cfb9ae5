"""Practice in simulated worlds: what is collected, and that something is learned from it."""

import numpy as np
import pytest

from schemas.errors import UserError
from services.policy.belief_features import names
from services.policy.linear import (
    Provenance,
    cost_of,
    default_expert,
    load_linear,
    save_linear,
)
from services.policy.training.collect import MOST_MOMENTS, Decision, collect, rollouts_of, workforce
from services.policy.training.dagger import TrainSettings
from services.policy.training.train import train_policy
from services.policy.training.weigh import learn, standard_of, states_of
from services.policy.training.worlds import TRAINING_SEEDS, VALIDATION_SEEDS, practices
from sim.experiments.table1 import NULL, ROWS

IS_STOP, LENGTH = names.index("is_stop"), names.index("length")


def decisions_of(count: int, words="relation", seed: int = 0) -> list[Decision]:
    """Of an expert who goes the shortest way; the stop, first, is always wrong."""
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(count):
        features = rng.random((10, MOST_MOMENTS, len(names))).astype(np.float32)
        features[:, :, IS_STOP] = 0
        features[0, 0, IS_STOP] = 1
        length = features[:, 0, LENGTH]
        margin = np.clip(length - length[1:].min(), 0, 1)
        margin[0] = 8
        made.append(Decision(features, words, 1 + int(np.argmin(length[1:])), margin))
    return made


def test_practice_never_meets_the_worlds_of_evaluation():
    assert min(TRAINING_SEEDS, VALIDATION_SEEDS) >= 100_000
    chosen = practices(TRAINING_SEEDS, 6) + practices(TRAINING_SEEDS, 6, start=6)
    seeds = {one.seed for one in chosen}
    assert seeds == set(range(TRAINING_SEEDS, TRAINING_SEEDS + 12))
    assert not seeds & {one.seed for one in practices(VALIDATION_SEEDS, 6)}
    assert {row.scenario.name for row in ROWS} <= {one.scenario.name for one in chosen}


def test_without_a_relation_any_object_of_the_class_is_meant():
    for one in practices(TRAINING_SEEDS, 4):
        several = one.scenario.world in ("two_hydrants_one_cone", "nearest_hydrant")
        assert len(one.goals) == (2 if several and one.scenario.text == NULL else 1)


def test_standardised_moves_have_no_mean_and_unit_deviation_within_decisions():
    decisions = decisions_of(30)
    standard = standard_of(decisions, 2)
    moves = [s.values[s.block == 0] for s in states_of(decisions, standard)]
    moves = [np.delete(one.reshape(len(one), 2, -1), IS_STOP, axis=2) for one in moves]
    np.testing.assert_allclose(np.concatenate(moves).mean(axis=0), 0, atol=1e-4)
    within = np.concatenate([one - one.mean(axis=0) for one in moves])
    np.testing.assert_allclose(within.std(axis=0), 1, atol=1e-3)


def test_standardised_stops_keep_what_is_constant():
    decisions = decisions_of(30)
    standard = standard_of(decisions, 2)
    stops = np.concatenate([s.values[s.block == 1] for s in states_of(decisions, standard)])
    assert (stops.reshape(len(stops), 2, -1)[:, 0, IS_STOP] == 1).all()


@pytest.mark.parametrize("moments", [1, 2, 3])
def test_what_was_learned_is_what_the_file_says(tmp_path, moments):
    learned = learn(decisions_of(150), moments, seed=0)
    agreement, loss = learned.score(decisions_of(50, seed=1))
    assert agreement > 0.6  # Chance is 0.1.
    assert loss < 0.5
    provenance = Provenance(
        git="", seed=0, expert="clairvoyant", rounds=1, decisions=150, agreement=0, success=0
    )
    save_linear(tmp_path / "w.json", learned.struct(provenance))
    cost = load_linear(tmp_path / "w.json")
    unseen = decisions_of(50, seed=1)
    chosen = [int(np.argmin(cost.costs(d.features.astype(float), d.words))) for d in unseen]
    assert np.mean([c == d.label for c, d in zip(chosen, unseen, strict=True)]) == agreement


def test_kinds_of_words_with_few_examples_share_what_was_learned_from_all():
    learned = learn(decisions_of(60) + decisions_of(5, "comparative"), 1, seed=0)
    assert set(learned.weights) == {"any", "relation"}


@pytest.mark.parametrize("wrong", [{"rounds": 0}, {"moments": 4}, {"workers": 0}])
def test_settings_out_of_range_are_refused(wrong, tmp_path):
    with pytest.raises(UserError, match="given: "):
        train_policy(TrainSettings(**wrong), lambda doing, share: None, tmp_path)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_episodes_are_the_same_for_any_number_of_workers():
    chosen = practices(TRAINING_SEEDS, 1)[4:6]
    rollouts = rollouts_of(chosen, "husky", "detection_rate", None, 0.5)
    alone = collect(rollouts, None, lambda done, of: None)
    with workforce(2) as workers:
        together = collect(rollouts, workers, lambda done, of: None)
    for one, other in zip(alone, together, strict=True):
        assert (one.success, one.distance_m) == (other.success, other.distance_m)
        assert [d.label for d in one.decisions] == [d.label for d in other.decisions]
        for first, second in zip(one.decisions, other.decisions, strict=True):
            np.testing.assert_array_equal(first.features, second.features)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_one_small_training_from_end_to_end(tmp_path):
    told = []
    settings = TrainSettings(rounds=1, episodes=1, validation=1, workers=2)
    report = train_policy(settings, lambda doing, share: told.append((doing, share)), tmp_path)
    (first,) = report["rounds"]
    assert 0 <= first["validation"]["agreement"] <= 1
    assert first["decisions"] > 8
    assert [one["moments"] for one in report["by_moments"]] == [1, 2, 3]
    weights = load_linear(tmp_path / f"husky.{default_expert}.json").settings
    assert weights.provenance.decisions == first["decisions"]
    assert cost_of(weights).moments == 2
    for moments in (1, 3):
        other = load_linear(tmp_path / f"husky.{default_expert}.k{moments}.json")
        assert other.moments == moments
    assert (tmp_path / f"husky.{default_expert}.report.json").exists()
    assert all(0 <= share <= 1 for _, share in told)
