"""Laws of the conformal set."""

import numpy as np
import pytest

from services.grounding.conformal import IMPROBABLE, calibrated, load_conformal


def test_what_was_meant_is_in_the_set_as_often_as_promised() -> None:
    rng = np.random.default_rng(0)
    covered = []
    for _ in range(400):
        calibration, tests = 0.5 * rng.random(39), 0.5 * rng.random(50)
        rule = calibrated(calibration.tolist())
        covered += (tests <= rule.threshold).tolist()
        for score in tests[tests <= rule.threshold]:
            assert 1 in rule.members({1: 1 - score, 2: score})
    assert np.mean(covered) == pytest.approx(0.9, abs=0.01)


def test_with_few_examples_only_the_improbable_is_ruled_out() -> None:
    rule = calibrated([0.01] * 8)
    assert rule.threshold == 1.0
    assert rule.members({"a": 0.6, "b": 0.3, "c": IMPROBABLE - 0.01}) == ("a", "b")


def test_sure_sentences_make_small_sets_and_the_best_always_stays() -> None:
    rule = calibrated([0.02] * 39)
    assert rule.members({"a": 0.3, "b": 0.99}) == ("b",)
    assert rule.members({"a": 0.95, "b": 0.01}) == ("a",)
    assert rule.members({}) == ()


def test_a_stricter_promise_keeps_more() -> None:
    scores = np.linspace(0, 0.8, 100).tolist()
    assert calibrated(scores, 0.05).threshold > calibrated(scores, 0.2).threshold


@pytest.mark.parametrize(("examples", "spread"), [(39, 0.05), (115, 0.03)])
def test_the_promise_is_coarse_and_says_how_much(examples: int, spread: float) -> None:
    assert calibrated([0.1] * examples).coverage_spread == pytest.approx(spread, abs=0.01)


def test_every_robot_with_weights_has_a_rule() -> None:
    assert 0.0 < load_conformal("husky").threshold <= 1.0


def test_where_no_reading_passes_the_likely_ones_stay() -> None:
    rule = calibrated([0.02] * 39)
    assert rule.members({"a": 0.55, "b": 0.44, "c": 0.01}) == ("a", "b")
    assert rule.members({"a": 0.92, "b": 0.05}) == ("a",)
